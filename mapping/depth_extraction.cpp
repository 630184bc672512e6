// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth_extraction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "mapping/kept_pixels.h"
#include "mapping/masked_median.h"
#include "mapping/named_choice.h"
#include "mapping/option_check.h"

namespace efm {
namespace {

constexpr NamedChoice<ExtractionMethod> kMethods[] = {{ExtractionMethod::kPaper, "paper"}};

constexpr int kFrame = 2;  ///< Pixels cleared at each side of the image.

/// A ridge of votes is wider than the errors of its top. With this share of the squared width, 73
/// to 78 % of a simulated desk's depths lie within one standard deviation of the truth and 98 %
/// within two, before the median filter, which halves the errors that remain.
constexpr double kErrorOfWidth = 0.17;

/// The confidence that becomes 255.
double whiteOf(const cv::Mat1f& confidence, const MaxConfidence& option,
               std::optional<double> sequence_maximum) {
  if (option.level == WhiteLevel::kFixed) return option.fixed;
  if (option.level == WhiteLevel::kSequence && sequence_maximum) return *sequence_maximum;
  double largest = 0;
  cv::minMaxLoc(confidence, nullptr, &largest);
  return largest;
}

/// Grey values of the confidence: 255 at `white`.
cv::Mat1b quantise(const cv::Mat1f& confidence, double white) {
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

/// Positions of the kept peaks between planes.
std::vector<float> positionsOf(const DsiPeaks& peaks, const KeptPixels& kept, bool subplane) {
  std::vector<float> positions(kept.size());
  kept.forEach([&](std::size_t i, cv::Point at) {
    const int plane = peaks.plane(at);
    positions[i] = static_cast<float>(
        subplane ? peakPosition(plane, peaks.before(at), peaks.confidence(at), peaks.after(at))
                 : plane);
  });
  return positions;
}

/// The image without the frame that is cleared; empty where nothing is left.
cv::Rect insideFrame(cv::Size size) {
  return {kFrame, kFrame, std::max(0, size.width - 2 * kFrame),
          std::max(0, size.height - 2 * kFrame)};
}

/// The depth map of the kept pixels inside the frame. Shares the image of confidences.
DepthMap depthsAt(const KeptPixels& kept, const std::vector<float>& positions,
                  const DsiPeaks& peaks, const DepthPlanes& planes) {
  const cv::Size size = peaks.confidence.size();
  const cv::Rect inner = insideFrame(size);
  DepthMap result{cv::Mat1f::zeros(size), peaks.confidence, cv::Mat1f::zeros(size)};
  kept.forEach([&](std::size_t i, cv::Point at) {
    if (!inner.contains(at)) return;
    const double position = positions[i];
    const double step = planes.inverseDepthStepAt(position);
    const double variance = peakVariance(peaks.before(at), peaks.confidence(at), peaks.after(at));
    result.depth(at) = static_cast<float>(planes.depthAt(position));
    // A single plane has no step: 0 times infinite would be nothing at all.
    result.variance(at) =
        static_cast<float>(std::isinf(variance) ? variance : step * step * variance);
  });
  return result;
}

constexpr std::array<std::array<int, 2>, 4> kBeside{{{0, -1}, {-1, 0}, {1, 0}, {0, 1}}};

/// Whether the pixel at `a` is the better one to copy from.
bool outranks(const DepthMap& map, cv::Point a, cv::Point b) {
  if (map.confidence(a) != map.confidence(b)) return map.confidence(a) > map.confidence(b);
  return map.depth(a) < map.depth(b);
}

/// Gives an empty pixel what the best of the kept ones beside it has.
void fillFromBeside(const cv::Mat1b& mask, cv::Point here, DepthMap& map) {
  const cv::Rect inner = insideFrame(mask.size());
  std::optional<cv::Point> best;
  for (const auto& [dx, dy] : kBeside) {
    const cv::Point there = here + cv::Point(dx, dy);
    if (!inner.contains(there) || mask(there) == 0) continue;
    if (!best || outranks(map, there, *best)) best = there;
  }
  map.depth(here) = map.depth(*best);
  map.confidence(here) = map.confidence(*best);
  map.variance(here) = map.variance(*best);
}

/// Grows the depths into empty pixels that a kept pixel lies beside. In place: what is filled is
/// not in the mask, and never copied from.
void dilate(const KeptPixels& kept, const cv::Mat1b& mask, DepthMap& map) {
  map.confidence = map.confidence.clone();  // it was the peaks'
  const cv::Rect inner = insideFrame(mask.size());
  kept.forEach([&](std::size_t, cv::Point at) {
    if (!inner.contains(at)) return;
    for (const auto& [dx, dy] : kBeside) {
      const cv::Point beside = at + cv::Point(dx, dy);
      const bool empty = inner.contains(beside) && mask(beside) == 0 && map.depth(beside) == 0;
      if (empty) fillFromBeside(mask, beside, map);
    }
  });
}

}  // namespace

std::string_view nameOf(ExtractionMethod method) { return nameIn(kMethods, method); }
ExtractionMethod extractionMethodFromName(std::string_view name) { return valueIn(kMethods, name); }

void DepthExtractionOptions::validate() const {
  requireOption(threshold_kernel >= 3 && threshold_kernel <= 255 && threshold_kernel % 2 == 1,
                "threshold_kernel", threshold_kernel, "odd, 3 to 255");
  requireOption(threshold_c >= -255 && threshold_c <= 255, "threshold_c", threshold_c,
                "-255 to 255");
  requireOption(max_confidence.level != WhiteLevel::kFixed ||
                    (std::isfinite(max_confidence.fixed) && max_confidence.fixed > 0),
                "max_confidence", max_confidence.fixed, "finite and above 0");
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

double peakVariance(float before, float peak, float after) {
  const double curvature = 2.0 * peak - before - after;
  if (before < 0 || after < 0 || !(curvature > 0)) return std::numeric_limits<double>::infinity();
  return kErrorOfWidth * peak / curvature;
}

DepthMap extractDepth(const DsiPeaks& peaks, const DepthPlanes& planes,
                      const DepthExtractionOptions& options,
                      std::optional<double> sequence_maximum) {
  options.validate();
  const double white = whiteOf(peaks.confidence, options.max_confidence, sequence_maximum);
  const cv::Mat1b mask = standOut(quantise(peaks.confidence, white), options);
  const KeptPixels kept(mask);
  const std::vector<float> positions = positionsOf(peaks, kept, options.subplane);
  const std::vector<float> medians = maskedMedian(kept, positions, options.median_size);
  DepthMap map = depthsAt(kept, medians, peaks, planes);
  if (options.dilate) dilate(kept, mask, map);
  return map;
}

}  // namespace efm
