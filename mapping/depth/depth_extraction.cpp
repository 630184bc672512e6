// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/depth_extraction.h"

#include <opencv2/imgproc.hpp>

#include <cmath>
#include <vector>

#include "mapping/depth/aggregated_extraction.h"
#include "mapping/depth/peak_fit.h"

namespace efm {

void DepthExtractionOptions::validate() const {
  requireFields(*this);
  if (dilate && extraction != ExtractionMethod::kPaper) {
    throw OptionError("dilate", "true", "false with extraction = aggregated: see neighbours",
                      {"extraction"});
  }
  const double white = max_confidence.fixed;
  requireOption(max_confidence.level != WhiteLevel::kFixed || (std::isfinite(white) && white > 0),
                "max_confidence", white, "finite and above 0");
}

DepthMap extractDepth(const SweptDsi& dsi, const DepthPlanes& planes,
                      const DepthExtractionOptions& options, const KeyframeFacts& facts) {
  options.validate();
  if (options.extraction == ExtractionMethod::kPaper) {
    return extractAsPaper(dsi.peaks, planes, options, facts.sequence_maximum);
  }
  return extractAggregated(dsi, planes, options, facts.parallax_px_m);
}

namespace {

/// Returns the confidence that becomes 255.
double whiteOf(const cv::Mat1f& confidence, const MaxConfidence& option,
               std::optional<double> sequence_maximum) {
  if (option.level == WhiteLevel::kFixed) return option.fixed;
  if (option.level == WhiteLevel::kSequence && sequence_maximum) return *sequence_maximum;
  double maximum = 0;
  cv::minMaxLoc(confidence, nullptr, &maximum);
  return maximum;
}

}  // namespace

DepthMap extractAsPaper(const DsiPeaks& peaks, const DepthPlanes& planes,
                        const DepthExtractionOptions& options,
                        std::optional<double> sequence_maximum) {
  options.validate();
  const double white = whiteOf(peaks.confidence, options.max_confidence, sequence_maximum);
  cv::Mat1b grey = cv::Mat1b::zeros(peaks.confidence.size());
  if (white > 0) peaks.confidence.convertTo(grey, CV_8U, 255.0 / white);  // rounds and clips
  cv::Mat1b mask;
  cv::adaptiveThreshold(grey, mask, 1, cv::ADAPTIVE_THRESH_GAUSSIAN_C, cv::THRESH_BINARY,
                        options.threshold_kernel, -options.threshold_c);
  const SparseMask sparse(mask);
  std::vector<float> positions(sparse.size());  // in planes, with a fraction
  sparse.forEach([&](std::size_t i, cv::Point at) {
    const int plane = peaks.plane(at);
    positions[i] =
        static_cast<float>(options.subplane ? peakPosition(plane, peaks.before(at),
                                                           peaks.confidence(at), peaks.after(at))
                                            : plane);
  });
  const std::vector<float> medians = maskedMedian(sparse, positions, options.median_size);
  std::vector<PlanePosition> found(sparse.size());
  sparse.forEach([&](std::size_t i, cv::Point at) {
    found[i] = {medians[i], peakVariance(peaks.before(at), peaks.confidence(at), peaks.after(at))};
  });
  DepthMap map = emptyDepthMap(peaks.confidence);
  addDepths(sparse, found, planes, 0, map);
  map.pixels.candidates = sparse.size();
  if (options.dilate) dilate(sparse, mask, map);
  return map;
}

}  // namespace efm
