// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "mapping/depth/depth_map.h"
#include "mapping/kernels/kernels.h"

namespace efm {

/// The positions and weights of the candidates in the 9x9 pixels around one pixel.
class Surroundings {
 public:
  void clear() {
    size_ = 0;
    total_ = 0;
  }
  void add(float position, float weight) {
    positions_[size_] = position;
    weights_[size_++] = weight;
    total_ += weight;
  }

  /// Returns the smallest position with at least half of the weight at or below it.
  float weightedMedian() { return smallestWith(0.5F * total_); }

  /// Returns the median distance from a position (the larger of two middle distances). Afterwards,
  /// the positions are distances with equal weights.
  float medianDistance(float from) {
    for (std::size_t i = 0; i < size_; ++i) positions_[i] = std::abs(positions_[i] - from);
    std::fill_n(weights_.begin(), size_, 1.0F);
    return smallestWith(static_cast<float>(size_ / 2 + 1));
  }

 private:
  /// Returns the smallest position with at least this weight at or below it.
  float smallestWith(float min_weight) {
    std::fill_n(below_.begin(), size_, 0.0F);
    ranks_.add(below_.data(), positions_.data(), weights_.data(), size_);
    float smallest = std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < size_; ++i) {
      if (below_[i] >= min_weight) smallest = std::min(smallest, positions_[i]);
    }
    return smallest;
  }

  using Values = std::array<float, PixelNeighbours::kMaxPixels + kernels::kRankPadding>;
  const kernels::RankFunctions& ranks_ = kernels::rankFunctions(fastestKernel());
  Values positions_{}, weights_{}, below_{};
  std::size_t size_ = 0;
  float total_ = 0;  // sum of the weights
};

}  // namespace efm
