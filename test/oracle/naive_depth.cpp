// SPDX-License-Identifier: BSD-3-Clause
#include "test/oracle/naive_mapper.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "mapping/depth/peak_fit.h"

namespace efm::oracle {
namespace {

constexpr int kFrame = 2;  ///< Pixels cleared at each side of the image.

/// Returns the confidence that becomes the grey value 255.
double whiteOf(const cv::Mat1f& confidence, const MaxConfidence& option,
               std::optional<double> sequence_maximum) {
  if (option.level == WhiteLevel::kFixed) return option.fixed;
  if (option.level == WhiteLevel::kSequence && sequence_maximum) return *sequence_maximum;
  double max = 0;
  cv::minMaxLoc(confidence, nullptr, &max);
  return max;
}

/// Returns the grey values of the confidence: 255 at `white`.
cv::Mat1b quantise(const cv::Mat1f& confidence, double white) {
  cv::Mat1b grey = cv::Mat1b::zeros(confidence.size());
  if (white > 0) confidence.convertTo(grey, CV_8U, 255.0 / white);  // rounds and clips
  return grey;
}

/// Runs adaptive Gaussian thresholding: non-zero if a pixel stands out from its surroundings.
cv::Mat1b standOut(const cv::Mat1b& grey, const DepthExtractionOptions& options) {
  cv::Mat1b mask;
  cv::adaptiveThreshold(grey, mask, 1, cv::ADAPTIVE_THRESH_GAUSSIAN_C, cv::THRESH_BINARY,
                        options.threshold_kernel, -options.threshold_c);
  return mask;
}

/// Returns the positions of the peaks between planes for the pixels of the mask.
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

/// Replaces each position by the lower median of the positions in the window around it.
cv::Mat1f maskedMedian(const cv::Mat1f& positions, const cv::Mat1b& mask, int window) {
  const int radius = window / 2;
  cv::Mat1f medians = cv::Mat1f::zeros(mask.size());
  std::vector<float> around;
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      if (mask(y, x) == 0) continue;
      around.clear();
      for (int j = std::max(0, y - radius); j <= std::min(mask.rows - 1, y + radius); ++j) {
        for (int i = std::max(0, x - radius); i <= std::min(mask.cols - 1, x + radius); ++i) {
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

/// Returns the image without the cleared frame; empty if nothing is left.
cv::Rect insideFrame(cv::Size size) {
  return {kFrame, kFrame, std::max(0, size.width - 2 * kFrame),
          std::max(0, size.height - 2 * kFrame)};
}

void clearFrame(cv::Mat1b& mask) {
  const cv::Rect inner = insideFrame(mask.size());
  cv::Mat1b inside = cv::Mat1b::zeros(mask.size());
  if (!inner.empty()) mask(inner).copyTo(inside(inner));
  mask = inside;
}

/// Returns the depth map of the mask's pixels.
DepthMap depthsAt(const cv::Mat1b& mask, const cv::Mat1f& positions, const DsiPeaks& peaks,
                  const DepthPlanes& planes) {
  DepthMap result{cv::Mat1f::zeros(mask.size()), peaks.confidence, cv::Mat1f::zeros(mask.size())};
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      if (mask(y, x) == 0) continue;
      const double position = positions(y, x);
      const double step = planes.inverseDepthStepAt(position);
      const double variance =
          peakVariance(peaks.before(y, x), peaks.confidence(y, x), peaks.after(y, x));
      result.depth(y, x) = static_cast<float>(planes.depthAt(position));
      // A single plane has no step to its neighbours: 0 times infinity would be NaN.
      result.variance(y, x) =
          static_cast<float>(std::isinf(variance) ? variance : step * step * variance);
    }
  }
  return result;
}

/// Returns whether the depth at `a` is copied rather than the depth at `b`.
bool outranks(const DepthMap& map, cv::Point a, cv::Point b) {
  if (map.confidence(a) != map.confidence(b)) return map.confidence(a) > map.confidence(b);
  return map.depth(a) < map.depth(b);
}

/// Copies depths into empty pixels that are adjacent to a pixel with a depth.
DepthMap dilated(const DepthMap& map) {
  DepthMap grown{map.depth.clone(), map.confidence.clone(), map.variance.clone()};
  const cv::Rect inner = insideFrame(map.depth.size());
  const cv::Rect image(cv::Point(0, 0), map.depth.size());
  for (int y = inner.y; y < inner.y + inner.height; ++y) {
    for (int x = inner.x; x < inner.x + inner.width; ++x) {
      const cv::Point here(x, y);
      if (map.depth(here) > 0) continue;
      std::optional<cv::Point> best;
      for (const cv::Point& step : {cv::Point(0, -1), {-1, 0}, {1, 0}, {0, 1}}) {
        const cv::Point there = here + step;
        if (!image.contains(there) || !(map.depth(there) > 0)) continue;
        if (!best || outranks(map, there, *best)) best = there;
      }
      if (!best) continue;
      grown.depth(here) = map.depth(*best);
      grown.confidence(here) = map.confidence(*best);
      grown.variance(here) = map.variance(*best);
    }
  }
  return grown;
}

}  // namespace

DepthMap extractDepth(const DsiPeaks& peaks, const DepthPlanes& planes,
                      const DepthExtractionOptions& options,
                      std::optional<double> sequence_maximum) {
  const double white = whiteOf(peaks.confidence, options.max_confidence, sequence_maximum);
  cv::Mat1b mask = standOut(quantise(peaks.confidence, white), options);
  const cv::Mat1f positions = positionsOf(peaks, mask, options.subplane);
  const cv::Mat1f medians = maskedMedian(positions, mask, options.median_size);
  clearFrame(mask);
  const DepthMap map = depthsAt(mask, medians, peaks, planes);
  return options.dilate ? dilated(map) : map;
}

}  // namespace efm::oracle
