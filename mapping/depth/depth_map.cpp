// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/depth_map.h"

#include <optional>

namespace efm {

SparseMask::SparseMask(const cv::Mat1b& mask) {
  // This loop has no branch that the processor would mispredict: it writes each column, and the
  // next column overwrites it unless the mask has the pixel.
  std::size_t count = 0;
  columns_.resize(static_cast<std::size_t>(cv::countNonZero(mask)) + 1);
  row_begin_.reserve(static_cast<std::size_t>(mask.rows) + 1);
  row_begin_.push_back(0);
  for (int y = 0; y < mask.rows; ++y) {
    const unsigned char* row = mask[y];
    for (int x = 0; x < mask.cols; ++x) {
      columns_[count] = x;
      count += row[x] != 0 ? 1 : 0;
    }
    row_begin_.push_back(count);
  }
  columns_.resize(count);
}

namespace {

constexpr int kFrame = 2;  ///< Pixels cleared at each side of the image.

constexpr std::array<std::array<int, 2>, 4> kAdjacent{{{0, -1}, {-1, 0}, {1, 0}, {0, 1}}};

/// Returns whether an empty pixel copies from `a` rather than from `b`.
bool outranks(const DepthMap& map, cv::Point a, cv::Point b) {
  if (map.confidence(a) != map.confidence(b)) return map.confidence(a) > map.confidence(b);
  return map.depth(a) < map.depth(b);
}

/// Copies the best adjacent pixel of the mask into an empty one.
void fillFromAdjacent(const cv::Mat1b& mask, cv::Point here, DepthMap& map) {
  const cv::Rect inner = insideFrame(mask.size());
  std::optional<cv::Point> best;
  for (const auto& [dx, dy] : kAdjacent) {
    const cv::Point there = here + cv::Point(dx, dy);
    if (!inner.contains(there) || mask(there) == 0) continue;
    if (!best || outranks(map, there, *best)) best = there;
  }
  map.depth(here) = map.depth(*best);
  map.confidence(here) = map.confidence(*best);
  map.variance(here) = map.variance(*best);
  map.probability(here) = map.probability(*best);
}

}  // namespace

PixelCounts& PixelCounts::operator+=(const PixelCounts& other) {
  candidates += other.candidates;
  at_nearest += other.at_nearest;
  at_farthest += other.at_farthest;
  ambiguous += other.ambiguous;
  neighbours += other.neighbours;
  return *this;
}

cv::Rect insideFrame(cv::Size size) {
  return {kFrame, kFrame, std::max(0, size.width - 2 * kFrame),
          std::max(0, size.height - 2 * kFrame)};
}

DepthMap emptyDepthMap(const cv::Mat1f& confidence) {
  const cv::Size size = confidence.size();
  return {cv::Mat1f::zeros(size), confidence, cv::Mat1f::zeros(size), cv::Mat1f::zeros(size)};
}

std::size_t addDepths(const SparseMask& mask, const std::vector<PlanePosition>& positions,
                      const DepthPlanes& planes, double min_probability, DepthMap& map) {
  const cv::Rect inner = insideFrame(map.depth.size());
  std::size_t added = 0;
  mask.forEach([&](std::size_t i, cv::Point at) {
    const auto [position, variance, probability] = positions[i];
    if (!inner.contains(at) || probability <= min_probability) return;
    const double step = planes.inverseDepthStepAt(position);
    map.depth(at) = static_cast<float>(planes.depthAt(position));
    // The step of a single plane is 0, and 0 times infinite is not a number.
    map.variance(at) = static_cast<float>(std::isinf(variance) ? variance : step * step * variance);
    map.probability(at) = probability;
    ++added;
  });
  return added;
}

// This works in place: filled pixels are not in the mask, so they are never copied.
void dilate(const SparseMask& sparse, const cv::Mat1b& mask, DepthMap& map) {
  map.confidence = map.confidence.clone();  // it is shared with the DSI's peaks
  const cv::Rect inner = insideFrame(mask.size());
  sparse.forEach([&](std::size_t, cv::Point at) {
    if (!inner.contains(at)) return;
    for (const auto& [dx, dy] : kAdjacent) {
      const cv::Point adjacent = at + cv::Point(dx, dy);
      const bool empty =
          inner.contains(adjacent) && mask(adjacent) == 0 && map.depth(adjacent) == 0;
      if (empty) fillFromAdjacent(mask, adjacent, map);
    }
  });
}

}  // namespace efm
