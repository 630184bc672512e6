// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/loop_closer.h"

#include <algorithm>
#include <cmath>

#include "maps/refinement/condensed_graph.h"

namespace efm {
namespace {

/// Loops are solved again when the map has grown by this part of their length: 1 / 20.
constexpr std::size_t kGrowthParts = 20;
/// First, loops count in full up to this multiple of the usual error. A loop with a large error
/// would have no weight otherwise.
constexpr double kTrustFactor = 30;
constexpr double kMaxRobustSigmas = 1000;
/// A larger error of a loop that counts in full, in standard deviations, shows a larger drift.
constexpr double kMaxTrustedError = 3;
/// A loop with a larger error after solving is wrong.
constexpr double kMaxError = 8;

/// The loops with a larger error.
std::vector<RelativePoseFactor*> contradictedLoops(KeyframeGraph& graph, double max_error) {
  std::vector<RelativePoseFactor*> loops;
  for (RelativePoseFactor& factor : graph.factors) {
    if (factor.robust && errorOf(factor, graph.keyframes[factor.from].T_world_ref,
                                 graph.keyframes[factor.to].T_world_ref) > max_error) {
      loops.push_back(&factor);
    }
  }
  return loops;
}

}  // namespace

void LoopCloser::search(KeyframeGraph& graph) {
  const std::size_t newest = graph.newest();
  const auto window = static_cast<std::size_t>(options_.window);
  if (!options_.loop.loops || options_.loop.loop_checks == 0 || newest <= window) return;
  for (const std::size_t older : graph.bestOverlaps(
           graph.nearestViews(), options_.loop.loop_min_overlap, options_.loop.loop_checks)) {
    check(graph,
          {older, newest,
           graph.keyframes[older].T_world_ref.inverse() * graph.keyframes[newest].T_world_ref});
  }
}

bool LoopCloser::check(KeyframeGraph& graph, const LoopCandidate& candidate) {
  const RefinedKeyframe& older = graph.keyframes[candidate.older];
  const RefinedKeyframe& newer = graph.keyframes[candidate.newer];
  ++counts_.checked;
  const TrackerErrors errors = graph.tracker.cautious();
  const Matrix6d covariance =
      errors.noiseCovariance(older.noise_scale) + errors.noiseCovariance(newer.noise_scale) +
      errors.driftCovariance(std::abs(newer.path_length_m - older.path_length_m));
  const auto [factor, failed_solves] = verifyLoop(candidate, older.cloud, newer.cloud, covariance,
                                                  options_.loop, options_.registration);
  graph.failed_solves += failed_solves;
  for (const std::size_t keyframe : {candidate.older, candidate.newer}) {
    if (keyframe + static_cast<std::size_t>(options_.window) < graph.keyframes.size()) {
      graph.keyframes[keyframe].cloud.releaseTree();
    }
  }
  if (!factor) return false;
  graph.factors.push_back(*factor);
  ++counts_.verified;
  const std::size_t oldest = std::min(candidate.older, candidate.newer);
  oldest_unsolved_ = std::min(oldest_unsolved_.value_or(oldest), oldest);
  return true;
}

std::optional<WindowGraph> LoopCloser::solveWhenDue(KeyframeGraph& graph) {
  const std::size_t newest = graph.newest();
  if (!oldest_unsolved_ || (newest - solved_at_) * kGrowthParts < newest - *oldest_unsolved_) {
    return std::nullopt;
  }
  solved_at_ = newest;
  WindowGraph solved = solve(graph, *oldest_unsolved_);
  oldest_unsolved_.reset();
  return solved;
}

WindowGraph LoopCloser::solveAll(KeyframeGraph& graph) {
  WindowGraph solved = solve(graph, 1);
  oldest_unsolved_.reset();
  return solved;
}

WindowGraph LoopCloser::solve(KeyframeGraph& graph, std::size_t first_free) {
  // Loops count in full. Where they do not fit, drift is larger than short paths have shown.
  PoseGraphOptions trusting = options_.graph;
  trusting.robust_sigmas = std::min(kTrustFactor * trusting.robust_sigmas, kMaxRobustSigmas);
  first_free = std::max<std::size_t>(first_free, 1);
  if (graph.keyframes.size() - first_free > kMaxSolvedTogether) {
    solveCondensed(graph, first_free, trusting);
    solveCondensed(graph, first_free, options_.graph);
    return graph.solveFrom(graph.keyframes.size() - static_cast<std::size_t>(options_.window),
                           options_.graph);
  }
  graph.solveFrom(first_free, trusting);
  while (!contradictedLoops(graph, kMaxTrustedError).empty() && graph.tracker.increaseDrift()) {
    graph.solveFrom(first_free, trusting);
  }
  // Wrong loops lose weight.
  WindowGraph solved = graph.solveFrom(first_free, options_.graph);
  // Loops that the other factors contradict are dropped.
  const std::vector<RelativePoseFactor*> wrong = contradictedLoops(graph, kMaxError);
  if (wrong.empty()) return solved;
  for (RelativePoseFactor* factor : wrong) {
    factor->sqrt_information.setZero();  // it keeps its index and has no weight
    factor->offset.setZero();
  }
  counts_.dropped += wrong.size();
  return graph.solveFrom(first_free, options_.graph);
}

}  // namespace efm
