// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string_view>

#include "mapping/depth_planes.h"
#include "mapping/dsi_peaks.h"

namespace efm {

/// How pixels and depths are chosen from the peaks of the DSI.
enum class ExtractionMethod {
  kPaper,  ///< Adaptive Gaussian thresholding and a median filter (Rebecq et al., IJCV 2018, 6.2).
};

std::string_view nameOf(ExtractionMethod method);
/// @throws std::invalid_argument naming the value and what is known.
ExtractionMethod extractionMethodFromName(std::string_view name);

/// What confidence becomes white, 255 of the 8-bit image that is thresholded.
enum class WhiteLevel {
  kKeyframe,  ///< The keyframe's own maximum.
  kSequence,  ///< A robust maximum over the recording: the same threshold for all keyframes.
  kFixed,     ///< A given number of votes.
};

struct MaxConfidence {
  WhiteLevel level = WhiteLevel::kKeyframe;
  double fixed = 0;  ///< With `kFixed`: finite and above 0.

  static MaxConfidence of(double votes) { return {WhiteLevel::kFixed, votes}; }
};

struct DepthExtractionOptions {
  ExtractionMethod extraction = ExtractionMethod::kPaper;
  int threshold_kernel = 5;  ///< Side of the Gaussian window in pixels; odd, 3 to 255.
  /// Grey values (of 255) by which a pixel must exceed its surroundings. Range: -255 to 255.
  double threshold_c = 5;
  MaxConfidence max_confidence;
  int median_size = 5;   ///< Side of the median window in pixels; odd, 1 (none) to 255.
  bool dilate = false;   ///< Grow the kept pixels by their four neighbours: the paper's MF.
  bool subplane = true;  ///< Fit a parabola through the peak and its neighbours.

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// A semi-dense depth map in the reference view.
struct DepthMap {
  cv::Mat1f depth;       ///< z-depth in metres; 0 where there is none.
  cv::Mat1f confidence;  ///< The raw fused value at the peak, at every pixel but dilated ones.
  /// Variance of inverse depth, 1/m^2: 0 where there is no depth, infinite where the peak lies on
  /// the first or last plane or is flat.
  cv::Mat1f variance;
};

/// Chooses the pixels whose confidence stands out and gives each its depth:
/// 1. c8 = round(255 c / max_confidence), clipped;
/// 2. keep where c8 - round(gauss(c8)) > C;
/// 3. position of the peak along the ray, between planes where `subplane` is set;
/// 4. lower median of the positions of the kept pixels in the window;
/// 5. clear a frame of 2 pixels;
/// 6. where `dilate` is set, give each pixel beside a kept one the depth, confidence and
///    variance of the most confident of them (of equals the nearer depth), the frame left
///    alone.
/// @param sequence_maximum what `WhiteLevel::kSequence` stands for at present; the keyframe's own
/// maximum where not given.
/// @throws std::invalid_argument where the options are not valid.
DepthMap extractDepth(const DsiPeaks& peaks, const DepthPlanes& planes,
                      const DepthExtractionOptions& options,
                      std::optional<double> sequence_maximum = std::nullopt);

/// Position of the peak between planes, in planes: a parabola through the three values, at most
/// half a plane from the peak. At the first and last plane the peak itself.
double peakPosition(int plane, float before, float peak, float after);

/// Variance of the peak's position, in planes^2: that of the Gaussian with the curvature of the
/// same parabola, c / (2c - before - after), times a factor that makes it the variance of its
/// errors. Infinite where there is no curvature.
double peakVariance(float before, float peak, float after);

}  // namespace efm
