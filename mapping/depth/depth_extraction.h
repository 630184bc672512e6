// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <optional>

#include "mapping/base/named_choice.h"
#include "mapping/base/option.h"
#include "mapping/depth/depth_map.h"
#include "mapping/dsi/dsi_columns.h"
#include "mapping/geometry/reference_view.h"

namespace efm {

/// The method that selects pixels and depths from the DSI.
enum class ExtractionMethod {
  kPaper,  ///< Adaptive Gaussian thresholding and a median filter (Rebecq et al., IJCV 2018, 6.2).
  /// Depth from the summed columns of neighbouring pixels, kept where they agree. Needs the columns
  /// of the DSI in addition to its peaks.
  kAggregated,
};

template <>
inline constexpr NamedChoice<ExtractionMethod> kNamesOf<ExtractionMethod>[] = {
    {ExtractionMethod::kPaper, "paper"},
    {ExtractionMethod::kAggregated, "aggregated"},
};

/// The confidence that becomes white: 255 in the 8-bit image that is thresholded.
enum class WhiteLevel {
  kKeyframe,  ///< The keyframe's own maximum.
  kSequence,  ///< A robust maximum over the recording: the same threshold for all keyframes.
  kFixed,     ///< A given number of votes.
};

struct MaxConfidence {
  WhiteLevel level = WhiteLevel::kKeyframe;
  double fixed = 0;  ///< White for `kFixed`, votes: finite and above 0.

  static MaxConfidence of(double votes) { return {WhiteLevel::kFixed, votes}; }
};

struct DepthExtractionOptions {
  ExtractionMethod extraction = ExtractionMethod::kAggregated;
  int threshold_kernel = 5;  ///< Side of the Gaussian window in pixels; odd, 3 to 255.

  // Options of `kAggregated`.
  /// Minimum local contrast of a pixel to be considered, as a fraction of the keyframe's mean
  /// confidence. Above 0.
  double min_local_contrast = 0.15;
  /// A depth is kept if its probability is above this (`DepthMap::probability`). 0 to below 1;
  /// larger values keep fewer and more certain points.
  double min_probability = 0.9;
  /// True: also depths for pixels near the candidates (`neighbourDepths`), each with its own
  /// probability.
  bool neighbours = false;
  bool keep_evidence = false;  ///< True: `DepthMap::evidence`. No option of files.

  // Options of `kPaper`.
  /// C: minimum difference of a pixel from its surroundings, in grey values (of 255). -255 to 255.
  double threshold_c = 5;
  MaxConfidence max_confidence;
  bool dilate = false;   ///< True: the mask grows to its four neighbours (the paper's MF).
  int median_size = 5;   ///< Side of the median window in pixels; odd, 1 (no filter) to 255.
  bool subplane = true;  ///< True: a parabola is fitted through the peak and its neighbours.

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("extraction", self.extraction);
    visit("threshold_kernel", self.threshold_kernel, Allowed::from(3, 255, "odd, 3 to 255").odd());
    visit("min_local_contrast", self.min_local_contrast,
          Allowed::above(0, Allowed::kFinite, "finite and above 0"));
    visit("min_probability", self.min_probability, Allowed::from(0, 1, "0 to below 1").below());
    visit("neighbours", self.neighbours);
    visit("threshold_c", self.threshold_c, Allowed::from(-255, 255, "-255 to 255"));
    visit("max_confidence", self.max_confidence);
    visit("median_size", self.median_size, Allowed::from(1, 255, "odd, 1 to 255").odd());
    visit("dilate", self.dilate);
    visit("subplane", self.subplane);
  }
  void validate() const;
};

/// Facts about a keyframe that the DSI does not contain.
struct KeyframeFacts {
  /// The value of `WhiteLevel::kSequence`. If it is not given, the keyframe's maximum is used.
  std::optional<double> sequence_maximum;
  /// The parallax of a unit of inverse depth, pixels per 1/m: see `ViewMotion`.
  double parallax_px_m = std::numeric_limits<double>::infinity();
};

/// Selects the pixels with local contrast and finds the depth of each. `kAggregated`: see
/// `extractAggregated`. `kPaper`:
/// 1. c8 = round(255 c / max_confidence), clipped;
/// 2. keep the pixel if c8 - round(gauss(c8)) > C;
/// 3. position of the peak along the ray, between planes if `subplane` is set;
/// 4. lower median of the positions of the mask's pixels in the window;
/// 5. clear a frame of 2 pixels;
/// 6. if `dilate` is set, grow the mask: see `dilate`.
DepthMap extractDepth(const SweptDsi& dsi, const DepthPlanes& planes,
                      const DepthExtractionOptions& options, const KeyframeFacts& facts = {});

/// Implements `ExtractionMethod::kPaper`: see `extractDepth`.
DepthMap extractAsPaper(const DsiPeaks& peaks, const DepthPlanes& planes,
                        const DepthExtractionOptions& options,
                        std::optional<double> sequence_maximum = std::nullopt);

}  // namespace efm
