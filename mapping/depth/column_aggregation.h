// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "mapping/depth/sparse_mask.h"
#include "mapping/dsi/dsi_columns.h"

namespace efm {

/// What the rays around a pixel say together.
struct AggregatedPeak {
  float position = 0;  ///< Of the largest sum, between planes.
  float width_sq = 0;  ///< c / (2c - before - after) there, planes^2; infinite where flat or at an
                       ///< end.
  /// The largest sum more than so many places from the peak, as a share of it: by
  /// `kLeastBeside` places and by each more, to `kMostBeside`. 0 to 1.
  static constexpr int kLeastBeside = 3;
  static constexpr int kMostBeside = 12;
  std::array<float, kMostBeside - kLeastBeside + 1> beyond{};
  bool at_end = false;  ///< The peak lies on the first or the last plane.
};

/// Sums the rays of the chosen pixels around each chosen pixel, weighted by a Gaussian of the
/// distance, and finds the peak of the sum and a parabola through it and its neighbours. Only
/// pixels that stand out are summed: the DSI between edges is noise, and smoothing it all moves
/// peaks instead of sharpening them.
/// @param chosen have rays (asserted). @param size of the view.
/// @return one per chosen pixel. Runs on the threads of the task arena that it is called in.
std::vector<AggregatedPeak> aggregateRays(const SparseMask& chosen, const DsiColumns& rays,
                                          cv::Size size);

/// Planes that count as one place, for a DSI of so many: with more planes than a hundred, the same
/// ridge spans more of them.
double planesOfOnePlace(int planes);

}  // namespace efm
