// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/local_agreement.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "mapping/depth/median.h"
#include "mapping/depth/sparse_mask.h"

namespace efm {
namespace {

/// Of the weight of other pixels by their distance.
constexpr float kDistanceSigma_px = 2;

/// A position and its weight.
using Weighted = std::pair<float, float>;

/// The smallest position with at least half of the weight at or below it. Reorders the positions.
float weightedMedian(std::vector<Weighted>& positions) {
  std::sort(positions.begin(), positions.end());
  double total = 0;
  for (const auto& [position, weight] : positions) total += weight;
  double below = 0;
  for (const auto& [position, weight] : positions) {
    below += weight;
    if (2 * below >= total) return position;
  }
  return positions.back().first;
}

/// Median distance from a position. Reorders the positions.
float medianDistance(std::vector<Weighted>& positions, float from) {
  for (auto& [position, weight] : positions) position = std::abs(position - from);
  return upperMedian(positions).first;
}

}  // namespace

std::vector<LocalAgreement> localAgreement(const SparseMask& mask, cv::Size size,
                                           const std::vector<float>& positions,
                                           const std::vector<float>& weights, float near) {
  const PixelNeighbours neighbours(mask, size);
  std::vector<LocalAgreement> agreement(mask.size());
  tbb::parallel_for(tbb::blocked_range<int>(0, mask.rows()), [&](const auto& rows) {
    std::vector<Weighted> around;
    for (int y = rows.begin(); y < rows.end(); ++y) {
      for (std::size_t i = mask.rowBegin(y); i < mask.rowBegin(y + 1); ++i) {
        around.clear();
        float agreeing = 0;
        float others = 0;
        neighbours.forEach({mask.column(i), y}, [&](std::size_t j, cv::Point offset) {
          around.emplace_back(positions[j], weights[j]);
          if (i == j) return;
          const auto distance_sq = static_cast<float>(offset.dot(offset));
          const float weight =
              weights[j] * std::exp(-distance_sq / (2 * kDistanceSigma_px * kDistanceSigma_px));
          others += weight;
          if (std::abs(positions[j] - positions[i]) < near) agreeing += weight;
        });
        agreement[i].median = weightedMedian(around);
        agreement[i].spread = medianDistance(around, agreement[i].median);
        agreement[i].agreeing_fraction = others > 0 ? agreeing / others : 0;
      }
    }
  });
  return agreement;
}

}  // namespace efm
