// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/local_agreement.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "mapping/depth/sparse_mask.h"
#include "mapping/dsi/voting_kernel.h"
#include "mapping/kernels/weighted_ranks.h"

namespace efm {
namespace {

/// Of the weight of other pixels by their distance.
constexpr float kDistanceSigma_px = 2;

/// The pixels around one pixel.
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

  /// The smallest position with at least half of the weight at or below it.
  float weightedMedian() { return smallestWith(0.5F * total_); }

  /// Median distance from a position, the larger one of two. Positions are distances afterwards,
  /// with equal weights.
  float medianDistance(float from) {
    for (std::size_t i = 0; i < size_; ++i) positions_[i] = std::abs(positions_[i] - from);
    std::fill_n(weights_.begin(), size_, 1.0F);
    return smallestWith(static_cast<float>(size_ / 2 + 1));
  }

 private:
  /// The smallest position with at least this weight at or below it.
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
  float total_ = 0;  // weight
};

}  // namespace

std::vector<LocalAgreement> localAgreement(const SparseMask& mask,
                                           const std::vector<float>& positions,
                                           const std::vector<float>& weights, float near) {
  auto by_distance = PixelNeighbours::gaussian(kDistanceSigma_px);
  by_distance[0] = 0;  // the pixel itself
  std::vector<LocalAgreement> agreement(mask.size());
  tbb::parallel_for(tbb::blocked_range<int>(0, mask.rows()), [&](const auto& rows) {
    PixelNeighbours neighbours(mask);
    Surroundings around;
    for (int y = rows.begin(); y < rows.end(); ++y) {
      for (std::size_t i = mask.rowBegin(y); i < mask.rowBegin(y + 1); ++i) {
        around.clear();
        float agreeing = 0;
        float others = 0;
        neighbours.forEach({mask.column(i), y}, [&](std::size_t j, cv::Point offset) {
          around.add(positions[j], weights[j]);
          const float weight =
              weights[j] * by_distance[static_cast<std::size_t>(offset.dot(offset))];
          others += weight;
          agreeing += std::abs(positions[j] - positions[i]) < near ? weight : 0.0F;
        });
        agreement[i].median = around.weightedMedian();
        agreement[i].spread = around.medianDistance(agreement[i].median);
        agreement[i].agreeing_fraction = others > 0 ? agreeing / others : 0;
      }
    }
  });
  return agreement;
}

}  // namespace efm
