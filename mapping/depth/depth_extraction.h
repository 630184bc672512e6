// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string_view>

#include "mapping/depth/depth_map.h"
#include "mapping/dsi/dsi_columns.h"
#include "mapping/geometry/depth_planes.h"

namespace efm {

/// How pixels and depths are chosen from the peaks of the DSI.
enum class ExtractionMethod {
  kPaper,  ///< Adaptive Gaussian thresholding and a median filter (Rebecq et al., IJCV 2018, 6.2).
  kAggregated,  ///< Depth from the rays of neighbouring pixels together, kept where they agree.
};

/// Whether the method looks at whole rays, not at their peaks alone: `SweptDsi::columns`.
bool keepsColumns(ExtractionMethod method);

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
  ExtractionMethod extraction = ExtractionMethod::kAggregated;
  int threshold_kernel = 5;  ///< Side of the Gaussian window in pixels; odd, 3 to 255.
  bool dilate = false;       ///< Grow the kept pixels by their four neighbours: the paper's MF.

  // `kAggregated`. Both are shares of the mean confidence of the pixels that have any, which makes
  // them the same for all recordings.
  /// By how much a pixel must exceed its surroundings to be looked at. Above 0.
  double min_excess = 0.15;
  /// What is left of the excess where peaks are ambiguous or neighbours disagree: to be kept. 0 or
  /// above; larger keeps fewer, surer points.
  double min_quality = 0.1;

  // `kPaper`.
  /// Grey values (of 255) by which a pixel must exceed its surroundings. Range: -255 to 255.
  double threshold_c = 5;
  MaxConfidence max_confidence;
  int median_size = 5;   ///< Side of the median window in pixels; odd, 1 (none) to 255.
  bool subplane = true;  ///< Fit a parabola through the peak and its neighbours.

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// Chooses the pixels whose confidence stands out and gives each its depth. `kAggregated` is told
/// in `extractAggregated`; `kPaper`:
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
DepthMap extractDepth(const SweptDsi& dsi, const DepthPlanes& planes,
                      const DepthExtractionOptions& options,
                      std::optional<double> sequence_maximum = std::nullopt);

}  // namespace efm
