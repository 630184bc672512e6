// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/paper_extraction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <stdexcept>

#include "mapping/depth/peak_fit.h"

namespace efm {
namespace {

const DepthPlanes kPlanes({0.5, 5.0, 100, PlaneSpacing::kInverse});

/// Peaks without neighbours, so that each lies exactly on its plane.
DsiPeaks flatPeaks(int width, int height) {
  return {cv::Mat1f::zeros(height, width), cv::Mat1i::zeros(height, width),
          cv::Mat1f(height, width, -1.0F), cv::Mat1f(height, width, -1.0F)};
}

DsiPeaks randomPeaks(int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  DsiPeaks peaks = flatPeaks(width, height);
  for (float& c : peaks.confidence) {
    c = std::exponential_distribution<float>(0.2F)(random);
  }
  for (int& plane : peaks.plane) plane = std::uniform_int_distribution<int>(0, 99)(random);
  return peaks;
}

DepthExtractionOptions plainOptions() {
  DepthExtractionOptions options;
  options.median_size = 1;
  options.subplane = false;
  return options;
}

TEST(PeakPosition, IsTheVertexOfTheParabola) {
  // 10 - 2 (z - 7.2)^2 at z = 6, 7, 8.
  const auto value = [](double z) { return static_cast<float>(10 - 2 * (z - 7.2) * (z - 7.2)); };
  EXPECT_NEAR(peakPosition(7, value(6), value(7), value(8)), 7.2, 1e-6);
}

TEST(PeakPosition, StaysAtThePeakWhereThereIsNoVertex) {
  EXPECT_EQ(peakPosition(0, -1, 5, 3), 0);
  EXPECT_EQ(peakPosition(99, 3, 5, -1), 99);
  EXPECT_EQ(peakPosition(7, 5, 5, 5), 7);
}

TEST(PeakPosition, IsAtMostHalfAPlaneAway) { EXPECT_EQ(peakPosition(7, 0, 5, 5), 7.5); }

TEST(DepthExtraction, KeepsThePixelsThatExceedTheGaussianOfTheirSurroundings) {
  const DsiPeaks peaks = randomPeaks(60, 40, 1);
  DepthExtractionOptions options = plainOptions();
  options.threshold_c = 7;
  const DepthMap map = extractAsPaper(peaks, kPlanes, options);

  const double largest = *std::max_element(peaks.confidence.begin(), peaks.confidence.end());
  cv::Mat1f grey(40, 60);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 60; ++x) {
      grey(y, x) = static_cast<float>(std::nearbyint(255.0 * peaks.confidence(y, x) / largest));
    }
  }
  // OpenCV's Gaussian of side 5 is the binomial one.
  const cv::Mat1f weights = (cv::Mat1f(5, 1) << 1, 4, 6, 4, 1) / 16.0F;
  cv::Mat1f blurred;
  cv::sepFilter2D(grey, blurred, CV_32F, weights, weights, {-1, -1}, 0, cv::BORDER_REPLICATE);
  int differing = 0;
  int kept = 0;
  for (int y = 2; y < 38; ++y) {
    for (int x = 2; x < 58; ++x) {
      const bool expected = grey(y, x) - std::nearbyint(blurred(y, x)) > 7;
      kept += expected ? 1 : 0;
      differing += expected != (map.depth(y, x) > 0) ? 1 : 0;
    }
  }
  EXPECT_GT(kept, 200);
  EXPECT_EQ(differing, 0);
}

TEST(DepthExtraction, AKeptPixelHasTheDepthOfItsPlane) {
  DsiPeaks peaks = flatPeaks(9, 9);
  peaks.confidence(4, 4) = 10;
  peaks.plane(4, 4) = 37;
  const DepthMap map = extractAsPaper(peaks, kPlanes, DepthExtractionOptions());
  EXPECT_EQ(cv::countNonZero(map.depth), 1);
  EXPECT_EQ(map.depth(4, 4), static_cast<float>(kPlanes.depth(37)));
  EXPECT_EQ(map.confidence(4, 4), 10.0F);
}

TEST(DepthExtraction, TheMedianIsTheLowerOneOfTheKeptPixelsAlone) {
  DsiPeaks peaks = flatPeaks(40, 9);
  // Kept pixels 2 apart, alone in their thresholding windows' centres; the rest has plane 99.
  peaks.plane.setTo(99);
  const int planes[] = {10, 20, 30, 40};
  for (int i = 0; i < 4; ++i) {
    peaks.confidence(4, 10 + 4 * i) = 10;
    peaks.plane(4, 10 + 4 * i) = planes[i];
  }
  DepthExtractionOptions options;
  options.subplane = false;
  options.median_size = 9;  // reaches the neighbours on both sides
  const DepthMap map = extractAsPaper(peaks, kPlanes, options);
  EXPECT_EQ(map.depth(4, 10), static_cast<float>(kPlanes.depth(10))) << "of {10, 20}";
  EXPECT_EQ(map.depth(4, 14), static_cast<float>(kPlanes.depth(20))) << "of {10, 20, 30}";
  EXPECT_EQ(map.depth(4, 18), static_cast<float>(kPlanes.depth(30))) << "of {20, 30, 40}";
  EXPECT_EQ(map.depth(4, 22), static_cast<float>(kPlanes.depth(30))) << "of {30, 40}";
}

TEST(DepthExtraction, AFrameOfTwoPixelsIsClearedOnAllFourSides) {
  const DsiPeaks peaks = randomPeaks(30, 20, 2);
  const DepthMap map = extractAsPaper(peaks, kPlanes, plainOptions());
  const cv::Rect inner(2, 2, 26, 16);
  EXPECT_EQ(cv::countNonZero(map.depth), cv::countNonZero(map.depth(inner)));
  for (const cv::Rect& side : {cv::Rect(2, 2, 26, 1), cv::Rect(2, 17, 26, 1), cv::Rect(2, 2, 1, 16),
                               cv::Rect(27, 2, 1, 16)}) {
    EXPECT_GT(cv::countNonZero(map.depth(side)), 0) << "one pixel further in there are some";
  }
}

TEST(DepthExtraction, SubPlanePositionsLieBetweenThePlanes) {
  DsiPeaks peaks = flatPeaks(9, 9);
  peaks.confidence(4, 4) = 10;
  peaks.before(4, 4) = 8;
  peaks.after(4, 4) = 9;
  peaks.plane(4, 4) = 37;
  const DepthMap map = extractAsPaper(peaks, kPlanes, DepthExtractionOptions());
  // Offset (9 - 8) / (2 * (20 - 17)) = 1/6 of a plane.
  EXPECT_NEAR(map.depth(4, 4), kPlanes.depthAt(37 + 1.0 / 6), 1e-6);
}

TEST(DepthExtraction, AFixedMaximumClipsAndMakesKeyframesComparable) {
  DsiPeaks peaks = flatPeaks(9, 9);
  peaks.confidence(4, 4) = 10;
  DepthExtractionOptions options;
  options.max_confidence =
      MaxConfidence::of(1000);  // 10 of 1000 is 3 grey values of 255: below C = 5
  EXPECT_EQ(cv::countNonZero(extractAsPaper(peaks, kPlanes, options).depth), 0);
  options.max_confidence = MaxConfidence::of(5);
  EXPECT_EQ(cv::countNonZero(extractAsPaper(peaks, kPlanes, options).depth), 1);
}

TEST(DepthExtraction, AnEmptyDsiGivesAnEmptyMap) {
  EXPECT_EQ(
      cv::countNonZero(extractAsPaper(flatPeaks(16, 16), kPlanes, DepthExtractionOptions()).depth),
      0);
  EXPECT_EQ(
      cv::countNonZero(extractAsPaper(flatPeaks(3, 2), kPlanes, DepthExtractionOptions()).depth), 0)
      << "smaller than its frame";
}

TEST(DepthExtraction, MoreThan255PlanesKeepTheirIndex) {
  const DepthPlanes many({0.5, 5.0, 5000, PlaneSpacing::kInverse});
  DsiPeaks peaks = flatPeaks(9, 9);
  peaks.confidence(4, 4) = 10;
  peaks.plane(4, 4) = 4321;
  EXPECT_NEAR(extractAsPaper(peaks, many, DepthExtractionOptions()).depth(4, 4), many.depth(4321),
              1e-6);
}

TEST(DepthExtraction, OptionsOutOfRangeAreNamed) {
  const auto with = [](auto change) {
    return [change] {
      DepthExtractionOptions options;
      change(options);
      options.validate();
    };
  };
  using Options = DepthExtractionOptions;
  using ::testing::HasSubstr;
  using ::testing::ThrowsMessage;
  EXPECT_THAT(with([](Options& o) { o.threshold_kernel = 4; }),
              ThrowsMessage<std::invalid_argument>(HasSubstr("threshold_kernel = 4")));
  EXPECT_THAT(with([](Options& o) { o.threshold_c = 300; }),
              ThrowsMessage<std::invalid_argument>(HasSubstr("threshold_c = 300")));
  EXPECT_THAT(with([](Options& o) { o.max_confidence = MaxConfidence::of(0); }),
              ThrowsMessage<std::invalid_argument>(HasSubstr("max_confidence = 0")));
  EXPECT_THAT(with([](Options& o) { o.median_size = 0; }),
              ThrowsMessage<std::invalid_argument>(HasSubstr("median_size = 0")));
}

}  // namespace
}  // namespace efm
