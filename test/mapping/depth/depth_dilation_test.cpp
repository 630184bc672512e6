// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "mapping/depth/paper_extraction.h"
#include "test/mapping/depth/same_image.h"

namespace efm {
namespace {

const DepthPlanes kPlanes({0.5, 5.0, 100, PlaneSpacing::kInverse});

DsiPeaks emptyPeaks(int width, int height) {
  return {cv::Mat1f::zeros(height, width), cv::Mat1i::zeros(height, width),
          cv::Mat1f::zeros(height, width), cv::Mat1f::zeros(height, width)};
}

void setPeak(DsiPeaks& peaks, cv::Point pixel, float confidence, int plane) {
  peaks.confidence(pixel) = confidence;
  peaks.plane(pixel) = plane;
  peaks.before(pixel) = confidence / 2;
  peaks.after(pixel) = confidence / 2;
}

DsiPeaks randomPeaks(std::uint32_t seed, int width, int height) {
  std::mt19937 random(seed);
  DsiPeaks peaks = emptyPeaks(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      // Few different confidences, so that some neighbours are equal.
      setPeak(peaks, {x, y}, static_cast<float>(random() % 12), static_cast<int>(random() % 100));
    }
  }
  return peaks;
}

DepthMap extract(const DsiPeaks& peaks, bool dilate) {
  DepthExtractionOptions options;
  options.median_size = 1;
  options.dilate = dilate;
  return extractAsPaper(peaks, kPlanes, options);
}

TEST(Dilation, APixelGrowsIntoItsFourNeighbours) {
  DsiPeaks peaks = emptyPeaks(11, 11);
  setPeak(peaks, {5, 5}, 10, 37);
  const DepthMap map = extract(peaks, true);
  const cv::Mat1b cross = cv::getStructuringElement(cv::MORPH_CROSS, {3, 3});
  EXPECT_EQ(cv::countNonZero(map.depth), 5);
  EXPECT_EQ(cv::countNonZero((map.depth(cv::Rect(4, 4, 3, 3)) > 0) != (cross > 0)), 0);
  const DepthMap kept = extract(peaks, false);
  for (const cv::Point& beside : {cv::Point(4, 5), {6, 5}, {5, 4}, {5, 6}}) {
    EXPECT_EQ(map.depth(beside), kept.depth(5, 5));
    EXPECT_EQ(map.confidence(beside), 10.0F);
    EXPECT_EQ(map.variance(beside), kept.variance(5, 5));
  }
}

TEST(Dilation, TheMostConfidentNeighbourWinsAndOfEqualsTheNearer) {
  DsiPeaks peaks = emptyPeaks(13, 11);
  setPeak(peaks, {4, 5}, 8, 20);
  setPeak(peaks, {6, 5}, 10, 60);
  setPeak(peaks, {8, 5}, 10, 30);
  const DepthMap map = extract(peaks, true);
  EXPECT_EQ(map.depth(5, 5), static_cast<float>(kPlanes.depth(60))) << "10 before 8";
  EXPECT_EQ(map.depth(5, 7), static_cast<float>(kPlanes.depth(30))) << "the nearer of two 10s";
}

TEST(Dilation, KeepsKeptPixelsAndGrowsExactlyIntoTheirEmptyNeighbours) {
  int grown_pixels = 0;
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    const DsiPeaks peaks = randomPeaks(seed, 32, 24);
    const DepthMap kept = extract(peaks, false);
    const DepthMap grown = extract(peaks, true);
    const cv::Rect inner(2, 2, 28, 20);
    for (int y = 0; y < 24; ++y) {
      for (int x = 0; x < 32; ++x) {
        const cv::Point here(x, y);
        std::vector<cv::Point> beside;
        for (const cv::Point& step : {cv::Point(0, -1), {-1, 0}, {1, 0}, {0, 1}}) {
          if (inner.contains(here + step) && kept.depth(here + step) > 0) {
            beside.push_back(here + step);
          }
        }
        if (kept.depth(here) > 0 || beside.empty() || !inner.contains(here)) {
          ASSERT_EQ(grown.depth(here), kept.depth(here)) << here;
          ASSERT_EQ(grown.confidence(here), kept.confidence(here)) << here;
          ASSERT_EQ(grown.variance(here), kept.variance(here)) << here;
          continue;
        }
        const auto best = std::max_element(beside.begin(), beside.end(),
                                           [&](const cv::Point& a, const cv::Point& b) {
                                             return std::pair(kept.confidence(a), -kept.depth(a)) <
                                                    std::pair(kept.confidence(b), -kept.depth(b));
                                           });
        ASSERT_EQ(grown.depth(here), kept.depth(*best)) << here;
        ASSERT_EQ(grown.confidence(here), kept.confidence(*best)) << here;
        ++grown_pixels;
      }
    }
  }
  EXPECT_GT(grown_pixels, 1000);
}

TEST(Dilation, TheFrameStaysClear) {
  const DepthMap map = extract(randomPeaks(3, 30, 20), true);
  EXPECT_EQ(cv::countNonZero(map.depth), cv::countNonZero(map.depth(cv::Rect(2, 2, 26, 16))));
}

TEST(Dilation, AFullMapStaysAsItIs) {
  const DsiPeaks peaks = randomPeaks(4, 32, 24);
  DepthExtractionOptions all;
  all.threshold_c = -255;  // keeps every pixel
  const DepthMap full = extractAsPaper(peaks, kPlanes, all);
  EXPECT_EQ(cv::countNonZero(full.depth), 28 * 20);
  all.dilate = true;
  EXPECT_TRUE(test::same(extractAsPaper(peaks, kPlanes, all), full));
}

TEST(Dilation, ImagesSmallerThanTheFrameStayEmpty) {
  for (const cv::Size size : {cv::Size(1, 1), {3, 3}, {4, 9}, {9, 4}}) {
    EXPECT_EQ(cv::countNonZero(extract(randomPeaks(5, size.width, size.height), true).depth), 0);
  }
}

TEST(WhiteLevel, OfTheSequenceThresholdsLikeTheSameFixedNumber) {
  const DsiPeaks peaks = randomPeaks(6, 32, 24);
  DepthExtractionOptions sequence;
  sequence.max_confidence.level = WhiteLevel::kSequence;
  for (const double white : {4.0, 11.0, 37.5, 200.0}) {
    DepthExtractionOptions fixed;
    fixed.max_confidence = MaxConfidence::of(white);
    EXPECT_TRUE(test::same(extractAsPaper(peaks, kPlanes, sequence, white),
                           extractAsPaper(peaks, kPlanes, fixed)))
        << white;
  }
  EXPECT_TRUE(
      test::same(extractAsPaper(peaks, kPlanes, sequence), extractAsPaper(peaks, kPlanes, {})))
      << "where no sequence is known, the keyframe's own maximum";
}

TEST(WhiteLevel, OfTheKeyframeIsItsMaximumWhateverTheSequence) {
  const DsiPeaks peaks = randomPeaks(7, 32, 24);
  DepthExtractionOptions fixed;
  fixed.max_confidence = MaxConfidence::of(11);  // of random() % 12
  EXPECT_TRUE(test::same(extractAsPaper(peaks, kPlanes, {}, 1000.0),
                         extractAsPaper(peaks, kPlanes, fixed)));
}

}  // namespace
}  // namespace efm
