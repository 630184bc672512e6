// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string_view>

#include "mapping/depth_planes.h"
#include "mapping/space_sweep.h"

namespace efm {

/// How pixels and depths are chosen from the peaks of the DSI.
enum class ExtractionMethod {
  kPaper,  ///< Adaptive Gaussian thresholding and a median filter (Rebecq et al., IJCV 2018, 6.2).
};

std::string_view nameOf(ExtractionMethod method);
/// @throws std::invalid_argument naming the value and what is known.
ExtractionMethod extractionMethodFromName(std::string_view name);

struct DepthExtractionOptions {
  ExtractionMethod extraction = ExtractionMethod::kPaper;
  int threshold_kernel = 5;  ///< Side of the Gaussian window in pixels; odd, 3 to 255.
  /// Grey values (of 255) by which a pixel must exceed its surroundings. Range: -255 to 255.
  double threshold_c = 5;
  /// The confidence that becomes 255; the keyframe's own maximum where not given. Above 0.
  std::optional<double> max_confidence;
  int median_size = 5;   ///< Side of the median window in pixels; odd, 1 (none) to 255.
  bool subplane = true;  ///< Fit a parabola through the peak and its neighbours.

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// A semi-dense depth map in the reference view.
struct DepthMap {
  cv::Mat1f depth;       ///< z-depth in metres; 0 where there is none.
  cv::Mat1f confidence;  ///< The raw fused value at the peak, at every pixel.
};

/// Chooses the pixels whose confidence stands out and gives each its depth:
/// 1. c8 = round(255 c / max_confidence), clipped;
/// 2. keep where c8 - round(gauss(c8)) > C;
/// 3. position of the peak along the ray, between planes where `subplane` is set;
/// 4. lower median of the positions of the kept pixels in the window;
/// 5. clear a frame of 2 pixels.
/// @throws std::invalid_argument where the options are not valid.
DepthMap extractDepth(const DsiPeaks& peaks, const DepthPlanes& planes,
                      const DepthExtractionOptions& options);

/// Position of the peak between planes, in planes: a parabola through the three values, at most
/// half a plane from the peak. At the first and last plane the peak itself.
double peakPosition(int plane, float before, float peak, float after);

}  // namespace efm
