// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/column_aggregation.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "mapping/depth/peak_fit.h"
#include "mapping/depth/sparse_mask.h"
#include "mapping/kernels/columns.h"

namespace efm {
namespace {

constexpr float kSigma_px = 1.5F;
constexpr double kMinFraction = 1.0 / 99;  // of the range of planes: a step

/// Finds the peak of a sum of columns.
class PeakFinder {
 public:
  PeakFinder(int planes, double step_planes)
      : planes_(planes),
        step_planes_(step_planes),
        base_(std::max(1, static_cast<int>(step_planes / (isWide() ? 1 : 4)))) {}

  AggregatedPeak find(const std::vector<float>& sum) const {
    const auto top = std::max_element(sum.begin(), sum.begin() + planes_);
    const auto plane = static_cast<int>(top - sum.begin());
    const float before = plane >= base_ ? sum[static_cast<std::size_t>(plane - base_)] : -1;
    const float after = plane < planes_ - base_ ? sum[static_cast<std::size_t>(plane + base_)] : -1;
    AggregatedPeak peak;
    peak.at_end = before < 0 || after < 0;
    peak.position = static_cast<float>(plane + base_ * peakPosition(0, before, *top, after));
    peak.width_sq = static_cast<float>(base_ * base_) * peakWidthSquared(before, *top, after);
    // From the largest distance to the smallest: each step adds the planes between.
    float second = 0;
    int left = 0;
    int right = planes_;
    for (std::size_t i = peak.second_peak.size(); i-- > 0;) {
      const double steps = AggregatedPeak::kMinSteps + static_cast<double>(i);
      const auto distance = static_cast<int>(std::lround(steps * step_planes_));
      second = std::max({second, maximumOf(sum, left, plane - distance),
                         maximumOf(sum, plane + distance + 1, right)});
      left = std::max(left, plane - distance);
      right = std::min(right, plane + distance + 1);
      peak.second_peak[i] = *top > 0 ? second / *top : 1;
    }
    return peak;
  }

 private:
  /// Whether a step is more than a hundredth of the range: the parallax is small.
  bool isWide() const { return step_planes_ > 1.001 * kMinFraction * (planes_ - 1); }
  static float maximumOf(const std::vector<float>& sum, int begin, int end) {
    return begin >= end ? 0 : *std::max_element(sum.begin() + begin, sum.begin() + end);
  }

  int planes_;
  double step_planes_;
  /// Planes from the peak to the values that its parabola goes through. With over 800 planes, or
  /// little parallax, the next ones differ by less than a step of their bytes.
  int base_;
};

}  // namespace

double planesPerStep(int planes, double range_px) {
  constexpr double kStepPx = 0.125;
  constexpr double kMaxFraction = 1.0 / 24;
  const double intervals = planes - 1;
  if (intervals < 2) return 1;
  const double step = intervals * std::clamp(kStepPx / range_px, kMinFraction, kMaxFraction);
  // At least a plane, but less where planes are closer than a quarter of a pixel.
  const double px_per_plane = range_px / intervals;
  return std::max(step, std::min(1.0, 4 * px_per_plane));
}

std::vector<AggregatedPeak> aggregateColumns(const SparseMask& candidates,
                                             const DsiColumns& columns, double step_planes) {
  const PeakFinder finder(columns.planes(), step_planes);
  std::vector<AggregatedPeak> peaks(candidates.size());
  const auto weights = PixelNeighbours::gaussian(kSigma_px);
  tbb::parallel_for(tbb::blocked_range<int>(0, candidates.rows()), [&](const auto& rows) {
    PixelNeighbours neighbours(candidates);
    std::vector<float> sum(static_cast<std::size_t>(columns.planes()) + kernels::kColumnPadding);
    for (int y = rows.begin(); y < rows.end(); ++y) {
      for (std::size_t i = candidates.rowBegin(y); i < candidates.rowBegin(y + 1); ++i) {
        const cv::Point pixel(candidates.column(i), y);
        assert(columns.has(pixel));
        std::fill(sum.begin(), sum.end(), 0.0F);
        neighbours.forEach(pixel, [&](std::size_t, cv::Point offset) {
          columns.addTo(sum.data(), pixel + offset,
                        weights[static_cast<std::size_t>(offset.dot(offset))]);
        });
        peaks[i] = finder.find(sum);
      }
    }
  });
  return peaks;
}

}  // namespace efm
