// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <array>
#include <limits>
#include <vector>

#include "mapping/depth/depth_extraction.h"
#include "mapping/depth/depth_map.h"
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

/// A pixel's depth compared with the depths around it, in 9x9 pixels.
struct LocalAgreement {
  float median = 0;  ///< Weighted median of the positions, its own included; planes.
  float spread = 0;  ///< Median distance of the positions from `median`; planes.
  /// Weighted fraction of the other pixels with a position near its own, 0 to 1. The weight falls
  /// with the distance in the image.
  float agreeing_fraction = 0;
};

/// @param positions of the mask's pixels, in planes. @param weights above 0.
/// @param near positions closer than this agree, planes.
/// @return one per pixel of the mask. Runs on the threads of the task arena that it is called in.
std::vector<LocalAgreement> localAgreement(const SparseMask& mask,
                                           const std::vector<float>& positions,
                                           const std::vector<float>& weights, float near);

/// `ExtractionMethod::kAggregated`. The paper takes every peak with enough contrast in the image,
/// even if the peak is flat along the ray or its neighbours disagree. Here:
/// 1. Select the pixels whose local contrast is above `min_local_contrast`. Local contrast:
///    confidence minus its Gaussian mean in a window, over the mean confidence of the keyframe.
/// 2. Sum the DSI columns around each (`aggregateColumns`); the peak of the sum is its first depth.
/// 3. The depth of a pixel is the median of the first depths in 9x9 pixels, weighted by local
///    contrast (`localAgreement`).
/// 4. Quality: the local contrast, lowered where the summed column has a second peak nearly as high
///    or is flat (an edge along the motion has no depth), where the first depth differs from the
///    median, and where few neighbours agree. Keep the pixel if it is above `min_quality`.
/// 5. Variance from the width of the peak and the spread of the depths around the pixel.
/// Peaks on the first and the last plane are not kept if there are planes between them: points
/// beyond the planes peak there.
/// @param dsi with columns, selected in a window of `threshold_kernel`.
/// @param parallax_px_m see `KeyframeFacts`.
DepthMap extractAggregated(const SweptDsi& dsi, const DepthPlanes& planes,
                           const DepthExtractionOptions& options,
                           double parallax_px_m = KeyframeFacts{}.parallax_px_m);

}  // namespace efm
