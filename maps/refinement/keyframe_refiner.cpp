// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/keyframe_refiner.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/base/option.h"

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

/// Returns the loops with an error above `max_error`, in standard deviations.
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
  ++counts_.loop_checks;
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
  ++counts_.loops;
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
  // Loops count in full. If they do not fit, drift is larger than short paths have shown.
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
  counts_.loops_dropped += wrong.size();
  return graph.solveFrom(first_free, options_.graph);
}

namespace {

/// Keyframes with a smaller overlap are not registered with each other.
constexpr double kMinOverlap = 0.1;
/// Limits of a plausible registration: its pairs, the fraction of its points with a pair, and its
/// distance from the prior in standard deviations.
constexpr std::size_t kMinPairs = 30;
constexpr double kMinPairedFraction = 0.3;
constexpr double kMaxPriorSigmas = 6;
/// Beyond this, differences of poses lose too many digits, and their squares overflow.
constexpr double kMaxPositionM = 1e9;

}  // namespace

void KeyframeRefiner::requireUsable(const Rigid3& T_odom_ref,
                                    const std::optional<PoseNoise>& stated) {
  if (!T_odom_ref.translation.allFinite() || !T_odom_ref.rotation.coeffs().allFinite() ||
      T_odom_ref.translation.cwiseAbs().maxCoeff() > kMaxPositionM) {
    throw std::invalid_argument("keyframe: its pose is not finite, or farther than 1e9 m");
  }
  if (!stated) return;
  requireOption(stated->noise_m >= 0 && std::isfinite(stated->noise_m), "keyframe: noise_m",
                stated->noise_m, "0 or above");
  requireOption(stated->noise_rad >= 0 && std::isfinite(stated->noise_rad), "keyframe: noise_rad",
                stated->noise_rad, "0 or above");
}

KeyframeRefiner::KeyframeRefiner(const RefinementOptions& options)
    : options_(options),
      graph_{{}, {}, TrackerModel(options.tracker, options.adapt_tracker)},
      loops_(options),
      covariance_(options.tracker.noiseCovariance()) {
  options_.validate();
}

void KeyframeRefiner::add(RegistrationCloud cloud, const Rigid3& T_odom_ref,
                          const std::optional<PoseNoise>& stated,
                          const std::optional<Rigid3>& T_last_ref) {
  const std::size_t number = graph_.keyframes.size();
  requireUsable(T_odom_ref, stated);
  RefinedKeyframe keyframe{std::move(cloud), T_odom_ref, T_odom_ref, T_odom_ref};
  keyframe.noise_scale = graph_.tracker.scaleOf(stated);
  keyframe.first_factor = graph_.factors.size();
  if (number > 0) predict(graph_.keyframes.back(), keyframe);  // 1.
  graph_.keyframes.push_back(std::move(keyframe));
  if (number == 0) return;
  const std::uint64_t registered = registered_;
  try {
    refineNewest(T_last_ref);
  } catch (...) {
    registered_ = registered;
    dropNewestPoints();
    throw;
  }
}

void KeyframeRefiner::refineNewest(const std::optional<Rigid3>& T_last_ref) {
  const std::size_t number = graph_.newest();
  if (T_last_ref) useCommonEvents(*T_last_ref);
  const auto window = static_cast<std::size_t>(options_.window);
  if (number > window) {
    graph_.keyframes[number - window - 1].cloud.releaseTree();
    graph_.addPlace(number - window - 1);
  }
  registerNewest();  // 2.
  const std::size_t first_free = number + 1 > window ? number + 1 - window : 0;
  updateCovariance(graph_.solveFrom(first_free, options_.graph));  // 3.
  loops_.search(graph_);                                           // 4.
  if (const auto solved = loops_.solveWhenDue(graph_)) updateCovariance(*solved);
}

/// Drops the points of the newest keyframe after an error: it keeps the tracker's motion. Factors
/// of other keyframes stay.
void KeyframeRefiner::dropNewestPoints() {
  RefinedKeyframe& newest = graph_.keyframes.back();
  graph_.factors.resize(newest.first_factor);
  newest.cloud.clear();
  newest.moved = true;
  const RefinedKeyframe& last = graph_.keyframes[graph_.newest() - 1];
  predict(last, newest);
  covariance_ += graph_.tracker.errors().driftCovariance(newest.path_length_m - last.path_length_m);
}

/// Predicts the pose by the motion of the tracker since the last keyframe.
void KeyframeRefiner::predict(const RefinedKeyframe& last, RefinedKeyframe& keyframe) {
  const Rigid3 T_last_ref = last.T_odom_ref.inverse() * keyframe.T_odom_ref;
  keyframe.T_world_ref_denoised = last.T_world_ref_denoised * T_last_ref;
  keyframe.T_world_ref = keyframe.T_world_ref_denoised;
  keyframe.path_length_m = last.path_length_m + T_last_ref.translation.norm();
}

namespace {

/// Returns the information about a small motion of a keyframe that moves its points in the image by
/// one pixel: the mean over its points. 0 without points.
Matrix6d informationOfPixel(const RegistrationCloud& cloud) {
  Matrix6d sum = Matrix6d::Zero();
  for (std::size_t i = 0; i < cloud.numQueryPoints(); ++i) {
    const Eigen::Vector3d p_ref = cloud.points()[i].p_ref.cast<double>();
    Eigen::Matrix<double, 2, 3> by_point;
    by_point << 1, 0, -p_ref.x() / p_ref.z(), 0, 1, -p_ref.y() / p_ref.z();
    by_point *= cloud.focalPx() / p_ref.z();
    Eigen::Matrix<double, 2, 6> by_motion;
    by_motion << -by_point, by_point * crossMatrix(p_ref);
    sum += by_motion.transpose() * by_motion;
  }
  return sum / static_cast<double>(std::max<std::size_t>(1, cloud.numQueryPoints()));
}

bool isPlausible(const Registration& registration) {
  return registration.inliers >= kMinPairs && registration.inlierRatio() >= kMinPairedFraction &&
         registration.from_prior <= kMaxPriorSigmas;
}

}  // namespace

/// Adds the motion since the last keyframe that the events of both windows show, and starts from
/// it.
void KeyframeRefiner::useCommonEvents(const Rigid3& T_last_ref) {
  // Slices of 10 ms lie within 0.3 pixels of the depth map, in six directions.
  constexpr double kSigmaPx = 0.3;
  const std::size_t number = graph_.newest();
  RefinedKeyframe& newest = graph_.keyframes[number];
  const RefinedKeyframe& last = graph_.keyframes[number - 1];
  const Matrix6d information = 6 / (kSigmaPx * kSigmaPx) * informationOfPixel(newest.cloud);
  if (information.isZero(0)) return;
  RelativePoseFactor factor{number - 1, number, T_last_ref};
  factor.sqrt_information = sqrtInformation(inverseOf(information + 1e-6 * Matrix6d::Identity()));
  newest.T_world_ref = last.T_world_ref * T_last_ref;
  graph_.factors.push_back(factor);
  graph_.tracker.addSample(factor, last, newest);
}

/// Registers the newest keyframe, if its points are not found, once more with points that are
/// farther apart.
Registration KeyframeRefiner::registrationOf(const std::vector<MapKeyframe>& map,
                                             const Matrix6d& covariance) const {
  const std::size_t number = graph_.newest();
  const RefinedKeyframe& newest = graph_.keyframes[number];
  const auto registered = [&](const Rigid3& T_world_ref, double sigmas,
                              const KeyframeRegistrationOptions& options) {
    const Matrix6d wider = sigmas * sigmas * covariance;
    return registerKeyframe(number, newest.cloud, map, {T_world_ref, sqrtInformation(wider)},
                            options);
  };
  Registration near = registered(newest.T_world_ref, 1, options_.registration);
  if (isPlausible(near)) return near;
  constexpr double kWider = 2.5;  // 2 pixels become 5
  constexpr double kSigmas = 5;
  KeyframeRegistrationOptions wider = options_.registration;
  wider.first_distance_px *= 2;
  wider.last_distance_px *= kWider;
  const Registration wide = registered(newest.T_world_ref, kSigmas, wider);
  near.failed_solves += wide.failed_solves;
  if (!isPlausible(wide)) return near;
  Registration again = registered(wide.T_world_ref, kSigmas, options_.registration);
  again.failed_solves += near.failed_solves;
  return again;
}

void KeyframeRefiner::registerNewest() {
  const std::size_t number = graph_.newest();
  RefinedKeyframe& newest = graph_.keyframes[number];
  const auto window = static_cast<std::size_t>(options_.window);
  std::vector<std::size_t> last(std::min(number, window));
  std::iota(last.begin(), last.end(), number - last.size());
  std::vector<MapKeyframe> map;
  for (const std::size_t i : graph_.bestOverlaps(last, kMinOverlap, options_.map_keyframes)) {
    map.push_back({i, &graph_.keyframes[i].cloud, graph_.keyframes[i].T_world_ref});
  }
  const TrackerErrors errors = graph_.tracker.cautious();
  const Matrix6d covariance =
      errors.noiseCovariance() + errors.noiseCovariance(newest.noise_scale) +
      errors.driftCovariance(newest.path_length_m - graph_.keyframes[number - 1].path_length_m);
  const Registration registration = registrationOf(map, covariance);
  graph_.failed_solves += registration.failed_solves;
  if (!isPlausible(registration)) return;
  ++registered_;
  newest.T_world_ref = registration.T_world_ref;
  for (const RelativePoseFactor& factor : registration.factors) {
    graph_.factors.push_back(factor);
    graph_.tracker.addSample(factor, graph_.keyframes[factor.from], newest);
  }
  graph_.tracker.update();
}

void KeyframeRefiner::updateCovariance(const WindowGraph& solved) {
  const RefinedKeyframe& newest = graph_.keyframes.back();
  const TrackerErrors& errors = graph_.tracker.errors();
  // If it cannot be computed, the drift of the whole path is used.
  covariance_ = solved.denoisedCovariance(options_.graph, graph_.newest())
                    .value_or(errors.driftCovariance(newest.path_length_m)) +
                errors.noiseCovariance(newest.noise_scale);
}

bool KeyframeRefiner::propose(const LoopCandidate& candidate) {
  const auto require = [&](std::size_t keyframe, const char* name) {
    requireOption(keyframe < keyframes(), name, keyframe,
                  "the number of a keyframe, below " + std::to_string(keyframes()));
  };
  require(candidate.older, "older keyframe of a loop");
  require(candidate.newer, "newer keyframe of a loop");
  requireOption(candidate.older != candidate.newer, "newer keyframe of a loop", candidate.newer,
                "another one than the older one");
  return loops_.check(graph_, candidate);
}

void KeyframeRefiner::finish() {
  if (keyframes() >= 2) updateCovariance(loops_.solveAll(graph_));
}

std::map<std::size_t, Rigid3> KeyframeRefiner::takeMoved() {
  std::map<std::size_t, Rigid3> moved;
  for (std::size_t i = 0; i < keyframes(); ++i) {
    if (graph_.keyframes[i].moved) moved.emplace_hint(moved.end(), i, T_world_ref(i));
  }
  for (const auto& [number, T_world_ref] : moved) graph_.keyframes[number].moved = false;
  return moved;
}

Rigid3 KeyframeRefiner::T_world_odom() const {
  if (graph_.keyframes.empty()) return {};
  const RefinedKeyframe& newest = graph_.keyframes.back();
  return newest.T_world_ref_denoised * newest.T_odom_ref.inverse();
}

RefinementCounts KeyframeRefiner::counts() const {
  RefinementCounts counts = loops_.counts();
  counts.registered = registered_;
  counts.failed_solves = graph_.failed_solves;
  return counts;
}

}  // namespace efm
