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
  float position = 0;  ///< In planes, with a fraction.
  float width_sq = 0;  ///< See `peakWidthSquared`; planes^2.
  /// The maximum of the sum farther than kMinSteps + i steps from the peak (element i), as a
  /// fraction of the peak. 0 to 1.
  static constexpr int kMinSteps = 3;
  static constexpr int kMaxSteps = 12;
  std::array<float, kMaxSteps - kMinSteps + 1> second_peak{};
  /// True if the peak lies on the first or the last plane (over 800 planes: within a quarter step).
  bool at_end = false;
};

/// Sums, for each pixel of a mask, the DSI columns of the mask's pixels in the 9x9 pixels around
/// it, weighted by a Gaussian of the distance. Finds the peak of each sum. Columns of other pixels
/// are not summed: between edges the DSI is noise, which would move the peaks.
/// @param candidates pixels with columns (asserted). @param step_planes see `planesPerStep`.
/// @return one peak per pixel. Runs on the threads of the caller's task arena.
std::vector<AggregatedPeak> aggregateColumns(const SparseMask& candidates,
                                             const DsiColumns& columns, double step_planes);

/// Returns the planes per step. A step is the unit in which peaks and their neighbours are
/// compared. It is a hundredth of the range of planes, but at least an eighth of a pixel of
/// parallax: a peak is about a pixel wide, however many planes lie on it. At least one plane, and
/// at most a 24th of the range, so that a second peak at 12 steps still lies inside.
/// @param range_px the parallax between the first and the last plane, pixels.
double planesPerStep(int planes, double range_px = std::numeric_limits<double>::infinity());

/// A pixel's depth compared with the depths around it, in 9x9 pixels.
struct LocalAgreement {
  float median = 0;  ///< Weighted median of all positions, the pixel's own included; planes.
  float spread = 0;  ///< Median distance of the positions from `median`; planes.
  /// Weighted fraction of the other pixels whose position is near the pixel's own, 0 to 1. The
  /// weight falls with the distance in the image.
  float agreeing_fraction = 0;
  int agreeing = 0;  ///< Number of these pixels.
};

/// Compares the position of each pixel of a mask with the positions around it.
/// @param positions one per pixel, planes. @param weights one per pixel, above 0.
/// @param near two positions agree if they differ by less than this, planes.
/// @return one value per pixel of the mask. Runs on the threads of the caller's task arena.
std::vector<LocalAgreement> localAgreement(const SparseMask& mask,
                                           const std::vector<float>& positions,
                                           const std::vector<float>& weights, float near);

/// Returns the local contrast: the confidence minus its Gaussian mean in a window of this side
/// (pixels), divided by the mean of the confidences above 0.
cv::Mat1f localContrast(const cv::Mat1f& confidence, int window);

/// Implements `ExtractionMethod::kAggregated`. The paper takes every peak with enough contrast in
/// the image, even if the peak is flat along the ray or its neighbours disagree. Here:
/// 1. Select the pixels whose local contrast is above `min_local_contrast`.
/// 2. Sum the DSI columns around each (`aggregateColumns`); the peak of the sum is its first depth.
/// 3. The depth of a pixel is the median of the first depths in 9x9 pixels, weighted by local
///    contrast (`localAgreement`).
/// 4. Probability (`CandidateInputs`) that this depth is right: from the local contrast, the width
///    of the peak, a second peak, and the depths around it. Keep the pixel if its probability is
///    above `min_probability`.
/// 5. Variance from the width of the peak and the spread of the depths around the pixel.
/// Flat columns are not kept, nor pixels without a neighbour that agrees. If there are more than
/// two planes, peaks on the first and the last plane are not kept: points beyond the planes have
/// their peaks there. With one or two planes, probabilities are not known.
/// @param dsi has columns, selected in a window of `threshold_kernel` pixels.
/// @param parallax_px_m see `KeyframeFacts`.
DepthMap extractAggregated(const SweptDsi& dsi, const DepthPlanes& planes,
                           const DepthExtractionOptions& options,
                           double parallax_px_m = KeyframeFacts{}.parallax_px_m);

}  // namespace efm
