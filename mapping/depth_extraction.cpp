// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth_extraction.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "mapping/named_choice.h"
#include "mapping/option_check.h"

namespace efm {
namespace {

constexpr NamedChoice<ExtractionMethod> kMethods[] = {{ExtractionMethod::kPaper, "paper"}};

constexpr int kFrame = 2;  ///< Pixels cleared at each side of the image.

/// Grey values of the confidence: 255 at `max_confidence`.
cv::Mat1b quantise(const cv::Mat1f& confidence, std::optional<double> max_confidence) {
  double largest = 0;
  cv::minMaxLoc(confidence, nullptr, &largest);
  const double white = max_confidence.value_or(largest);
  cv::Mat1b grey = cv::Mat1b::zeros(confidence.size());
  if (white > 0) confidence.convertTo(grey, CV_8U, 255.0 / white);  // rounds and clips
  return grey;
}

/// Adaptive Gaussian thresholding: non-zero where a pixel stands out from its surroundings.
cv::Mat1b standOut(const cv::Mat1b& grey, const DepthExtractionOptions& options) {
  cv::Mat1b mask;
  cv::adaptiveThreshold(grey, mask, 1, cv::ADAPTIVE_THRESH_GAUSSIAN_C, cv::THRESH_BINARY,
                        options.threshold_kernel, -options.threshold_c);
  return mask;
}

/// Positions of the peaks between planes, where the mask is set.
cv::Mat1f positionsOf(const DsiPeaks& peaks, const cv::Mat1b& mask, bool subplane) {
  cv::Mat1f positions = cv::Mat1f::zeros(mask.size());
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      if (mask(y, x) == 0) continue;
      const int plane = peaks.plane(y, x);
      positions(y, x) =
          static_cast<float>(subplane ? peakPosition(plane, peaks.before(y, x),
                                                     peaks.confidence(y, x), peaks.after(y, x))
                                      : plane);
    }
  }
  return positions;
}

/// Replaces each kept position by the lower median of the kept ones in the window around it.
cv::Mat1f maskedMedian(const cv::Mat1f& positions, const cv::Mat1b& mask, int window) {
  const int reach = window / 2;
  cv::Mat1f medians = cv::Mat1f::zeros(mask.size());
  std::vector<float> around;
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      if (mask(y, x) == 0) continue;
      around.clear();
      for (int j = std::max(0, y - reach); j <= std::min(mask.rows - 1, y + reach); ++j) {
        for (int i = std::max(0, x - reach); i <= std::min(mask.cols - 1, x + reach); ++i) {
          if (mask(j, i) != 0) around.push_back(positions(j, i));
        }
      }
      const auto middle = around.begin() + static_cast<std::ptrdiff_t>((around.size() - 1) / 2);
      std::nth_element(around.begin(), middle, around.end());
      medians(y, x) = *middle;
    }
  }
  return medians;
}

void clearFrame(cv::Mat1b& mask) {
  const cv::Rect inner(kFrame, kFrame, mask.cols - 2 * kFrame, mask.rows - 2 * kFrame);
  cv::Mat1b kept = cv::Mat1b::zeros(mask.size());
  if (inner.width > 0 && inner.height > 0) mask(inner).copyTo(kept(inner));
  mask = kept;
}

}  // namespace

std::string_view nameOf(ExtractionMethod method) { return nameIn(kMethods, method); }
ExtractionMethod extractionMethodFromName(std::string_view name) { return valueIn(kMethods, name); }

void DepthExtractionOptions::validate() const {
  requireOption(threshold_kernel >= 3 && threshold_kernel <= 255 && threshold_kernel % 2 == 1,
                "threshold_kernel", threshold_kernel, "odd, 3 to 255");
  requireOption(threshold_c >= -255 && threshold_c <= 255, "threshold_c", threshold_c,
                "-255 to 255");
  requireOption(!max_confidence || (std::isfinite(*max_confidence) && *max_confidence > 0),
                "max_confidence", max_confidence.value_or(0), "finite and above 0");
  requireOption(median_size >= 1 && median_size <= 255 && median_size % 2 == 1, "median_size",
                median_size, "odd, 1 to 255");
}

double peakPosition(int plane, float before, float peak, float after) {
  if (before < 0 || after < 0) return plane;
  const double curvature = 2.0 * peak - before - after;
  if (!(curvature > 0)) return plane;
  const double offset = 0.5 * (double{after} - double{before}) / curvature;
  return plane + std::clamp(offset, -0.5, 0.5);
}

DepthMap extractDepth(const DsiPeaks& peaks, const DepthPlanes& planes,
                      const DepthExtractionOptions& options) {
  options.validate();
  const cv::Mat1b grey = quantise(peaks.confidence, options.max_confidence);
  cv::Mat1b mask = standOut(grey, options);
  const cv::Mat1f positions = positionsOf(peaks, mask, options.subplane);
  const cv::Mat1f medians = maskedMedian(positions, mask, options.median_size);
  clearFrame(mask);

  DepthMap result{cv::Mat1f::zeros(mask.size()), peaks.confidence};
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      if (mask(y, x) != 0) {
        result.depth(y, x) = static_cast<float>(planes.depthAt(medians(y, x)));
      }
    }
  }
  return result;
}

}  // namespace efm
