// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "mapping/depth/sparse_mask.h"
#include "mapping/dsi/dsi_columns.h"

namespace efm {

/// The peak of the summed DSI columns around a pixel.
struct AggregatedPeak {
  float position = 0;  ///< Between planes.
  float width_sq = 0;  ///< `peakWidthSquared`.
  /// The maximum of the sum at a distance from the peak, as a fraction of the peak: element i for
  /// more than kMinSteps + i steps. 0 to 1.
  static constexpr int kMinSteps = 3;
  static constexpr int kMaxSteps = 12;
  std::array<float, kMaxSteps - kMinSteps + 1> second_peak{};
  /// The peak lies on the first or the last plane (with over 800 planes, in their quarter step).
  bool at_end = false;
};

/// For each pixel of a mask, sums the DSI columns of the mask's pixels in 9x9 pixels around,
/// weighted by a Gaussian of the distance, and finds the peak of the sum. Columns of other pixels
/// are not summed: between edges the DSI is noise, which would move the peaks.
/// @param candidates pixels with columns (asserted). @param step_planes see `planesPerStep`.
/// @return one per pixel. Runs on the threads of the task arena that it is called in.
std::vector<AggregatedPeak> aggregateColumns(const SparseMask& candidates,
                                             const DsiColumns& columns, double step_planes);

/// Planes per step, the unit in which peaks and their neighbours are compared. A step is a
/// hundredth of the range of planes, but at least an eighth of a pixel of parallax: a peak is about
/// a pixel wide, however many planes lie on it. At least one plane, and at most a 24th of the
/// range, so that a second peak at 12 steps still lies inside.
/// @param range_px the parallax between the first and the last plane, pixels.
double planesPerStep(int planes, double range_px = std::numeric_limits<double>::infinity());

}  // namespace efm
