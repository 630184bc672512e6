// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/keyframe_graph.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "maps/refinement/loop_closing.h"

namespace efm {
namespace {

constexpr std::size_t kMaxNearestViews = 50;
/// With up to 0.3 MB of points each.
constexpr std::size_t kMaxPlaces = 1000;

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

void KeyframeGraph::addPlace(std::size_t keyframe) {
  places.push_back(keyframe);
  if (places.size() <= kMaxPlaces) return;
  const auto redundant = places.begin() + static_cast<std::ptrdiff_t>(mostRedundant());
  keyframes[*redundant].cloud.clear();
  places.erase(redundant);
}

/// The index of the newer one of the two places that are nearest to each other, in position and in
/// centre of view.
std::size_t KeyframeGraph::mostRedundant() const {
  using Position = Eigen::Matrix<double, 6, 1>;
  std::vector<Position> positions;
  for (const std::size_t place : places) {
    positions.emplace_back();
    positions.back() << keyframes[place].T_world_ref.translation, centreOfView(keyframes[place]);
  }
  std::size_t redundant = 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < positions.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const double squared = (positions[i] - positions[k]).squaredNorm();
      if (squared >= nearest) continue;
      nearest = squared;
      redundant = i;
    }
  }
  return redundant;
}

std::vector<std::size_t> KeyframeGraph::nearestViews() const {
  const Eigen::Vector3d centre = centreOfView(keyframes.back());
  std::vector<std::pair<double, std::size_t>> ranked;
  for (const std::size_t i : places) {
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
