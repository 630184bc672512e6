// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/keyframe_graph.h"

#include <algorithm>
#include <utility>

#include "maps/refinement/loop_closing.h"

namespace efm {
namespace {

constexpr std::size_t kMaxNearestViews = 50;

Eigen::Vector3d centreOfView(const RefinedKeyframe& keyframe) {
  const double inverse_depth = keyframe.cloud.middleInverseDepth();
  const double depth = inverse_depth > 0 ? 1 / inverse_depth : 0;
  return keyframe.T_world_ref * Eigen::Vector3d(0, 0, depth);
}

std::vector<std::size_t> numbersOf(const std::vector<std::pair<double, std::size_t>>& ranked,
                                   std::size_t count) {
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < std::min(count, ranked.size()); ++i) {
    numbers.push_back(ranked[i].second);
  }
  return numbers;
}

}  // namespace

std::vector<std::size_t> KeyframeGraph::bestOverlaps(const std::vector<std::size_t>& candidates,
                                                     double min_overlap, int count) const {
  const RefinedKeyframe& of = keyframes.back();
  std::vector<std::pair<double, std::size_t>> ranked;
  for (const std::size_t candidate : candidates) {
    const RefinedKeyframe& in = keyframes[candidate];
    const double overlap =
        viewOverlap(of.cloud, in.cloud, in.T_world_ref.inverse() * of.T_world_ref);
    if (overlap >= min_overlap) ranked.emplace_back(overlap, candidate);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  return numbersOf(ranked, static_cast<std::size_t>(count));
}

std::vector<std::size_t> KeyframeGraph::nearestViews(std::size_t end) const {
  const Eigen::Vector3d centre = centreOfView(keyframes.back());
  std::vector<std::pair<double, std::size_t>> ranked;
  for (std::size_t i = 0; i < end; ++i) {
    ranked.emplace_back((centreOfView(keyframes[i]) - centre).squaredNorm(), i);
  }
  const std::size_t count = std::min(ranked.size(), kMaxNearestViews);
  std::partial_sort(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(count),
                    ranked.end());
  return numbersOf(ranked, count);
}

WindowGraph KeyframeGraph::solveFrom(std::size_t first_free, const PoseGraphOptions& options) {
  first_free = std::max<std::size_t>(first_free, 1);
  WindowGraph window(keyframes, first_free);
  for (std::size_t f = keyframes[first_free].first_factor; f < factors.size(); ++f) {
    window.add(factors[f]);
  }
  window.addTracker(tracker.inGraph());
  if (!window.solve(options)) {
    ++failed_solves;
    return window;
  }
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    if (!window.has(i)) continue;
    RefinedKeyframe& keyframe = keyframes[i];
    keyframe.T_world_ref_denoised = window.T_world_ref_denoised(i);
    if (i < first_free) continue;
    keyframe.moved = keyframe.moved || !isSame(keyframe.T_world_ref, window.T_world_ref(i));
    keyframe.T_world_ref = window.T_world_ref(i);
  }
  return window;
}

}  // namespace efm
