// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/depth_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace efm {
namespace {

constexpr int kFrame = 2;  ///< Pixels cleared at each side of the image.

constexpr std::array<std::array<int, 2>, 4> kBeside{{{0, -1}, {-1, 0}, {1, 0}, {0, 1}}};

/// Whether the pixel at `a` is the better one to copy from.
bool outranks(const DepthMap& map, cv::Point a, cv::Point b) {
  if (map.confidence(a) != map.confidence(b)) return map.confidence(a) > map.confidence(b);
  return map.depth(a) < map.depth(b);
}

/// Gives an empty pixel what the best of the kept ones beside it has.
void fillFromBeside(const cv::Mat1b& mask, cv::Point here, DepthMap& map) {
  const cv::Rect inner = insideFrame(mask.size());
  std::optional<cv::Point> best;
  for (const auto& [dx, dy] : kBeside) {
    const cv::Point there = here + cv::Point(dx, dy);
    if (!inner.contains(there) || mask(there) == 0) continue;
    if (!best || outranks(map, there, *best)) best = there;
  }
  map.depth(here) = map.depth(*best);
  map.confidence(here) = map.confidence(*best);
  map.variance(here) = map.variance(*best);
}

}  // namespace

cv::Rect insideFrame(cv::Size size) {
  return {kFrame, kFrame, std::max(0, size.width - 2 * kFrame),
          std::max(0, size.height - 2 * kFrame)};
}

DepthMap depthMapOf(const SparseMask& kept, const std::vector<PlanePosition>& positions,
                    const cv::Mat1f& confidence, const DepthPlanes& planes) {
  const cv::Size size = confidence.size();
  const cv::Rect inner = insideFrame(size);
  DepthMap result{cv::Mat1f::zeros(size), confidence, cv::Mat1f::zeros(size)};
  kept.forEach([&](std::size_t i, cv::Point at) {
    if (!inner.contains(at)) return;
    const auto [position, variance] = positions[i];
    const double step = planes.inverseDepthStepAt(position);
    result.depth(at) = static_cast<float>(planes.depthAt(position));
    // A single plane has no step: 0 times infinite would be nothing at all.
    result.variance(at) =
        static_cast<float>(std::isinf(variance) ? variance : step * step * variance);
  });
  return result;
}

// In place: what is filled is not in the mask, and never copied from.
void dilate(const SparseMask& kept, const cv::Mat1b& mask, DepthMap& map) {
  map.confidence = map.confidence.clone();  // it was the peaks'
  const cv::Rect inner = insideFrame(mask.size());
  kept.forEach([&](std::size_t, cv::Point at) {
    if (!inner.contains(at)) return;
    for (const auto& [dx, dy] : kBeside) {
      const cv::Point beside = at + cv::Point(dx, dy);
      const bool empty = inner.contains(beside) && mask(beside) == 0 && map.depth(beside) == 0;
      if (empty) fillFromBeside(mask, beside, map);
    }
  });
}

}  // namespace efm
