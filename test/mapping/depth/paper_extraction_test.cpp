// SPDX-License-Identifier: BSD-3-Clause
// Examples worked out by hand; paper_extraction_oracle_test.cpp compares all steps with an oracle.
#include "mapping/depth/paper_extraction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "test/mapping/depth/same_image.h"
#include "test/mapping/options/refused_option.h"

namespace efm::paper_extraction_test {
namespace {

const DepthPlanes kPlanes({0.5, 5.0, 100, PlaneSpacing::kInverse});
/// Variance of the peak's errors, as a fraction of the squared width.
constexpr double kErrorOfWidth = 0.17;

/// Peaks without neighbours, so that each lies exactly on its plane.
DsiPeaks flatPeaks(int width, int height) {
  return {cv::Mat1f::zeros(height, width), cv::Mat1i::zeros(height, width),
          cv::Mat1f(height, width, -1.0F), cv::Mat1f(height, width, -1.0F)};
}

void setPeak(DsiPeaks& peaks, cv::Point pixel, float confidence, int plane) {
  peaks.confidence(pixel) = confidence;
  peaks.plane(pixel) = plane;
}

/// One bright pixel in the middle of 9x9.
DsiPeaks onePeak(int plane, float before, float peak, float after) {
  DsiPeaks peaks = flatPeaks(9, 9);
  setPeak(peaks, {4, 4}, peak, plane);
  peaks.before(4, 4) = before;
  peaks.after(4, 4) = after;
  return peaks;
}

DsiPeaks randomPeaks(int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  DsiPeaks peaks = flatPeaks(width, height);
  for (float& c : peaks.confidence) c = std::exponential_distribution<float>(0.2F)(random);
  for (int& plane : peaks.plane) plane = std::uniform_int_distribution<int>(0, 99)(random);
  return peaks;
}

DepthExtractionOptions plain(bool dilate = false) {
  DepthExtractionOptions options;
  options.median_size = 1;
  options.subplane = false;
  options.dilate = dilate;
  return options;
}

TEST(PaperExtraction, KeepsThePixelsAboveTheGaussianMeanOfTheirSurroundings) {
  const DsiPeaks peaks = randomPeaks(60, 40, 1);
  DepthExtractionOptions options = plain();
  options.threshold_c = 7;
  const DepthMap map = extractAsPaper(peaks, kPlanes, options);

  const double maximum = *std::max_element(peaks.confidence.begin(), peaks.confidence.end());
  cv::Mat1f grey(40, 60);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 60; ++x) {
      grey(y, x) = static_cast<float>(std::nearbyint(255.0 * peaks.confidence(y, x) / maximum));
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

TEST(PaperExtraction, AKeptPixelHasTheDepthOfItsPlaneAndItsVarianceInInverseDepth) {
  // Inverse depths 0.1 / m apart.
  const DepthPlanes planes({1.0, 2.0, 6, PlaneSpacing::kInverse});
  const DepthMap map = extractAsPaper(onePeak(3, 7, 8, 7), planes, {});
  EXPECT_EQ(cv::countNonZero(map.depth), 1);
  EXPECT_EQ(map.depth(4, 4), static_cast<float>(planes.depth(3)));
  EXPECT_EQ(map.confidence(4, 4), 8.0F);
  EXPECT_NEAR(map.variance(4, 4), 0.1 * 0.1 * kErrorOfWidth * 4, 1e-8);
  EXPECT_EQ(cv::countNonZero(map.variance), 1) << "0 where there is no depth";
}

TEST(PaperExtraction, SubPlanePositionsLieBetweenThePlanes) {
  // Offset (9 - 8) / (2 * (20 - 17)) = 1/6 of a plane.
  const DepthMap map = extractAsPaper(onePeak(37, 8, 10, 9), kPlanes, {});
  EXPECT_NEAR(map.depth(4, 4), kPlanes.depthAt(37 + 1.0 / 6), 1e-6);
}

TEST(PaperExtraction, MoreThan255PlanesKeepTheirIndex) {
  const DepthPlanes many({0.5, 5.0, 5000, PlaneSpacing::kInverse});
  const DepthMap map = extractAsPaper(onePeak(4321, -1, 10, -1), many, {});
  EXPECT_NEAR(map.depth(4, 4), many.depth(4321), 1e-6);
}

TEST(PaperExtraction, TheMedianIsTheLowerOneOfTheKeptPixelsAlone) {
  DsiPeaks peaks = flatPeaks(40, 9);
  // Kept pixels four apart; the others have plane 99.
  peaks.plane.setTo(99);
  for (int i = 0; i < 4; ++i) setPeak(peaks, {10 + 4 * i, 4}, 10, 10 + 10 * i);
  DepthExtractionOptions options;
  options.subplane = false;
  options.median_size = 9;  // contains the neighbours on both sides
  const DepthMap map = extractAsPaper(peaks, kPlanes, options);
  EXPECT_EQ(map.depth(4, 10), static_cast<float>(kPlanes.depth(10))) << "of {10, 20}";
  EXPECT_EQ(map.depth(4, 14), static_cast<float>(kPlanes.depth(20))) << "of {10, 20, 30}";
  EXPECT_EQ(map.depth(4, 18), static_cast<float>(kPlanes.depth(30))) << "of {20, 30, 40}";
  EXPECT_EQ(map.depth(4, 22), static_cast<float>(kPlanes.depth(30))) << "of {30, 40}";
}

TEST(PaperExtraction, AFrameOfTwoPixelsIsClearedOnAllFourSides) {
  const DepthMap map = extractAsPaper(randomPeaks(30, 20, 2), kPlanes, plain());
  const cv::Rect inner(2, 2, 26, 16);
  EXPECT_EQ(cv::countNonZero(map.depth), cv::countNonZero(map.depth(inner)));
  for (const cv::Rect& side : {cv::Rect(2, 2, 26, 1), cv::Rect(2, 17, 26, 1), cv::Rect(2, 2, 1, 16),
                               cv::Rect(27, 2, 1, 16)}) {
    EXPECT_GT(cv::countNonZero(map.depth(side)), 0) << "the next pixels have depths";
  }
}

TEST(PaperExtraction, AnEmptyDsiGivesAnEmptyMap) {
  for (const cv::Size& size : {cv::Size(16, 16), {3, 2}}) {
    const DepthMap map = extractAsPaper(flatPeaks(size.width, size.height), kPlanes, {});
    EXPECT_EQ(cv::countNonZero(map.depth), 0);
  }
}

TEST(PaperExtraction, VarianceWithLinearSpacingDependsOnTheStepsAroundThePeak) {
  // 1, 1.5, 2, 2.5, 3 m. Around 2 m: from 1.75 to 2.25 m.
  const DepthPlanes planes({1.0, 3.0, 5, PlaneSpacing::kLinear});
  const double step = 1 / 1.75 - 1 / 2.25;
  EXPECT_NEAR(planes.inverseDepthStepAt(2), step, 1e-12);
  const DepthMap map = extractAsPaper(onePeak(2, 7, 8, 7), planes, {});
  EXPECT_NEAR(map.variance(4, 4), step * step * kErrorOfWidth * 4, 1e-7);
}

TEST(PaperExtraction, VarianceIsInfiniteAtTheLimitsOnFlatPeaksAndForASinglePlane) {
  for (const PlaneSpacing spacing : {PlaneSpacing::kInverse, PlaneSpacing::kLinear}) {
    const DepthPlanes planes({1.0, 3.0, 5, spacing});
    for (const auto& peaks : {onePeak(0, -1, 8, 7), onePeak(4, 7, 8, -1), onePeak(2, 8, 8, 8)}) {
      EXPECT_TRUE(std::isinf(extractAsPaper(peaks, planes, {}).variance(4, 4)));
    }
  }
  const DepthPlanes single({1.0, 3.0, 1, PlaneSpacing::kInverse});
  const DepthMap map = extractAsPaper(onePeak(0, -1, 8, -1), single, {});
  EXPECT_EQ(map.depth(4, 4), 1.0F);
  EXPECT_TRUE(std::isinf(map.variance(4, 4))) << map.variance(4, 4);
}

TEST(PaperExtraction, DilationGrowsAPixelIntoItsFourNeighbours) {
  const DsiPeaks peaks = onePeak(37, 5, 10, 5);
  const DepthMap kept = extractAsPaper(peaks, kPlanes, plain());
  const DepthMap map = extractAsPaper(peaks, kPlanes, plain(true));
  const cv::Mat1b cross = cv::getStructuringElement(cv::MORPH_CROSS, {3, 3});
  EXPECT_EQ(cv::countNonZero(map.depth), 5);
  EXPECT_EQ(cv::countNonZero((map.depth(cv::Rect(3, 3, 3, 3)) > 0) != (cross > 0)), 0);
  for (const cv::Point& adjacent : {cv::Point(3, 4), {5, 4}, {4, 3}, {4, 5}}) {
    EXPECT_EQ(map.depth(adjacent), kept.depth(4, 4));
    EXPECT_EQ(map.confidence(adjacent), 10.0F);
    EXPECT_EQ(map.variance(adjacent), kept.variance(4, 4));
  }
}

TEST(PaperExtraction, DilationCopiesTheMostConfidentNeighbourAndOfEqualsTheNearer) {
  DsiPeaks peaks = flatPeaks(13, 11);
  setPeak(peaks, {4, 5}, 8, 20);
  setPeak(peaks, {6, 5}, 10, 60);
  setPeak(peaks, {8, 5}, 10, 30);
  const DepthMap map = extractAsPaper(peaks, kPlanes, plain(true));
  EXPECT_EQ(map.depth(5, 5), static_cast<float>(kPlanes.depth(60))) << "10 before 8";
  EXPECT_EQ(map.depth(5, 7), static_cast<float>(kPlanes.depth(30))) << "the nearer of two 10s";
}

TEST(PaperExtraction, AFixedMaximumClipsAndMakesKeyframesComparable) {
  DepthExtractionOptions options;
  const auto kept = [&](double white) {
    options.max_confidence = MaxConfidence::of(white);
    return cv::countNonZero(extractAsPaper(onePeak(0, -1, 10, -1), kPlanes, options).depth);
  };
  EXPECT_EQ(kept(1000), 0) << "10 of 1000 is 3 grey values of 255: below C = 5";
  EXPECT_EQ(kept(5), 1);
}

TEST(PaperExtraction, TheSequenceMaximumThresholdsLikeTheSameFixedNumber) {
  const DsiPeaks peaks = randomPeaks(32, 24, 6);
  const auto fixed = [&](double white) {
    DepthExtractionOptions options;
    options.max_confidence = MaxConfidence::of(white);
    return extractAsPaper(peaks, kPlanes, options);
  };
  DepthExtractionOptions sequence;
  sequence.max_confidence.level = WhiteLevel::kSequence;
  for (const double white : {4.0, 11.0, 37.5, 200.0}) {
    EXPECT_TRUE(test::same(extractAsPaper(peaks, kPlanes, sequence, white), fixed(white))) << white;
  }
  const double own = *std::max_element(peaks.confidence.begin(), peaks.confidence.end());
  EXPECT_TRUE(test::same(extractAsPaper(peaks, kPlanes, sequence), fixed(own)))
      << "without a sequence maximum, the keyframe's own";
  EXPECT_TRUE(test::same(extractAsPaper(peaks, kPlanes, {}, 1000.0), fixed(own)))
      << "the keyframe's own by default";
}

TEST(PaperExtraction, InvalidOptionsAreNamed) {
  using Options = DepthExtractionOptions;
  using test::expectRefused;
  expectRefused<Options>("threshold_kernel = 4", [](auto& o) { o.threshold_kernel = 4; });
  expectRefused<Options>("threshold_c = 300", [](auto& o) { o.threshold_c = 300; });
  expectRefused<Options>("max_confidence = 0",
                         [](auto& o) { o.max_confidence = MaxConfidence::of(0); });
  expectRefused<Options>("median_size = 0", [](auto& o) { o.median_size = 0; });
  expectRefused<Options>("min_local_contrast = 0", [](auto& o) { o.min_local_contrast = 0; });
  expectRefused<Options>("min_quality = -1", [](auto& o) { o.min_quality = -1; });
}

}  // namespace
}  // namespace efm::paper_extraction_test
