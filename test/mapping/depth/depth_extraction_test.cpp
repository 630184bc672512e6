// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <opencv2/core.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <random>
#include <sstream>
#include <vector>

#include "mapping/depth/depth_extraction.h"
#include "mapping/depth/peak_fit.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/keyframes/played_recording.h"
#include "test/oracle/naive_mapper.h"
#include "test/plugin/temporary_folder.h"

namespace efm::depth_extraction_test {
namespace {

constexpr int kPlaneCount = 600;  // more than a byte can count

DsiPeaks emptyPeaks(cv::Size size) {
  return {cv::Mat1f::zeros(size), cv::Mat1i::zeros(size), cv::Mat1f(size, -1.0F),
          cv::Mat1f(size, -1.0F)};
}

/// Sets a peak's neighbours as in a DSI: none beyond the first and the last plane.
void setPeak(DsiPeaks& peaks, cv::Point at, int plane, std::mt19937& random) {
  const float peak = peaks.confidence(at);
  const auto below = [&] { return peak * std::uniform_real_distribution<float>(0.5F, 1)(random); };
  peaks.plane(at) = plane;
  peaks.before(at) = plane == 0 ? -1.0F : below();
  peaks.after(at) = plane == kPlaneCount - 1 ? -1.0F : below();
}

/// Draws peaks without a scene: every pixel has its own confidence and plane.
DsiPeaks noisePeaks(cv::Size size, std::uint32_t seed) {
  std::mt19937 random(seed);
  DsiPeaks peaks = emptyPeaks(size);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      peaks.confidence(y, x) = std::exponential_distribution<float>(0.2F)(random);
      setPeak(peaks, {x, y}, static_cast<int>(random() % kPlaneCount), random);
    }
  }
  return peaks;
}

/// Draws ridges of votes along slanted edges over a low floor, as in a keyframe.
DsiPeaks ridgePeaks(cv::Size size, std::uint32_t seed) {
  std::mt19937 random(seed);
  DsiPeaks peaks = emptyPeaks(size);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const double phase = 0.21 * x + 0.08 * y;
      const double ridge = std::exp(-8 * std::pow(std::sin(phase), 2));
      // Votes are whole numbers, so that some neighbours are equal.
      peaks.confidence(y, x) =
          static_cast<float>(std::floor(40 * ridge) + static_cast<double>(random() % 4));
      const int plane = 20 + static_cast<int>(15 * std::sin(0.05 * x)) +
                        static_cast<int>(random() % 3) - static_cast<int>(random() % 3);
      setPeak(peaks, {x, y}, plane, random);
    }
  }
  return peaks;
}

std::vector<DepthExtractionOptions> manyOptions() {
  std::vector<DepthExtractionOptions> all;
  for (const int kernel : {3, 5, 9}) {
    for (const double c : {-255.0, 0.0, 5.0, 12.5}) {
      for (const int median : {1, 3, 5, 15, 255}) {
        DepthExtractionOptions options;
        options.threshold_kernel = kernel;
        options.threshold_c = c;
        options.median_size = median;
        options.extraction = ExtractionMethod::kPaper;
        options.dilate = median == 5 || median == 255;
        options.subplane = median != 3;
        if (c == 5) options.max_confidence.level = WhiteLevel::kSequence;
        if (c == 12.5 && median > 3) options.max_confidence = MaxConfidence::of(17.5);
        all.push_back(options);
      }
    }
  }
  return all;
}

/// Expects that depth extraction gives the same bits as its steps, computed one by one.
void expectSame(const DsiPeaks& peaks, const DepthExtractionOptions& options) {
  const bool linear = options.threshold_kernel == 5;
  const DepthPlanes planes(
      {0.5, 5.0, kPlaneCount, linear ? PlaneSpacing::kLinear : PlaneSpacing::kInverse});
  const cv::Mat1f confidence = peaks.confidence.clone();
  for (const auto sequence : {std::optional<double>(), {23.5}}) {
    EXPECT_TRUE(test::same(extractAsPaper(peaks, planes, options, sequence),
                           oracle::extractDepth(peaks, planes, options, sequence)));
    EXPECT_TRUE(test::same(peaks.confidence, confidence)) << "the peaks are left alone";
  }
}

std::string described(cv::Size size, const DepthExtractionOptions& options) {
  std::ostringstream words;
  words << size << ", kernel " << options.threshold_kernel << ", C " << options.threshold_c
        << ", median " << options.median_size << (options.dilate ? ", dilated" : "");
  return words.str();
}

TEST(PaperExtraction, IsTheOraclesForAnySizeAndOptions) {
  for (const cv::Size& size : {cv::Size(1, 1), {5, 1}, {1, 6}, {4, 4}, {5, 5}, {17, 9}, {33, 31}}) {
    for (const DepthExtractionOptions& options : manyOptions()) {
      SCOPED_TRACE(described(size, options));
      expectSame(noisePeaks(size, 1), options);
      expectSame(ridgePeaks(size, 2), options);
      expectSame(emptyPeaks(size), options);
    }
  }
}

TEST(DepthExtractionOptions, AFixedMaximumIsFiniteAndAboveZero) {
  for (const double votes : {1e-9, 0.0, -1.0, 1.0 * NAN, 1.0 * INFINITY}) {
    DepthExtractionOptions options;
    options.max_confidence = MaxConfidence::of(votes);
    EXPECT_EQ(messageOf([&] { options.validate(); }).find("max_confidence = ") == 0, votes != 1e-9);
  }
}

TEST(PeakFit, IsTheParabolaThroughThreeValues) {
  /// Variance of the peak's errors, as a fraction of the squared width.
  constexpr double kErrorOfWidth = 0.17;
  const struct {
    float before, peak, after;
    double offset;    // position - plane of the peak, in planes
    double width_sq;  // planes^2
  } cases[] = {
      {7.12F, 9.92F, 8.72F, 0.2, 2.48},  // 10 - 2 (z - 0.2)^2
      {1, 8, 1, 0, 8.0 / 14},
      {7, 8, 7, 0, 4},
      {8, 10, 9, 1.0 / 6, 10.0 / 3},
      {9, 10, 8, -1.0 / 6, 10.0 / 3},
      {900, 1000, 800, -1.0 / 6, 10.0 / 3},  // in any unit
      {0, 5, 5, 0.5, 1},                     // at most half a plane away
      {5, 5, 0, -0.5, 1},
      {5, 5, 5, 0, INFINITY},
      {0, 0, 0, 0, INFINITY},
      {-1, 5, 3, 0, INFINITY},  // the first plane
      {3, 5, -1, 0, INFINITY},  // the last plane
      {-1, 5, -1, 0, INFINITY},
  };
  for (const auto& c : cases) {
    SCOPED_TRACE(testing::Message() << c.before << ", " << c.peak << ", " << c.after);
    EXPECT_NEAR(peakPosition(7, c.before, c.peak, c.after), 7 + c.offset, 1e-6);
    const double variance = peakVariance(c.before, c.peak, c.after);
    const float width_sq = peakWidthSquared(c.before, c.peak, c.after);
    if (std::isinf(c.width_sq)) {
      EXPECT_TRUE(std::isinf(width_sq) && std::isinf(variance));
    } else {
      EXPECT_NEAR(width_sq, c.width_sq, 1e-6);
      EXPECT_NEAR(variance, kErrorOfWidth * c.width_sq, 1e-6);
    }
  }
}

TEST(RobustMaximum, IsTheSmallestValueThatNinetyFivePercentDoNotExceed) {
  std::mt19937 random(1);
  RobustMaximum maximum;
  EXPECT_FALSE(maximum.value());
  std::vector<double> values;
  for (int n = 1; n <= 300; ++n) {
    const double value = static_cast<double>(random() % 100) - 50;  // many equal values
    maximum.add(value);
    values.push_back(value);
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    const auto enough = std::find_if(sorted.begin(), sorted.end(), [&](double candidate) {
      const auto not_above = std::count_if(values.begin(), values.end(),
                                           [&](double other) { return other <= candidate; });
      return 100 * not_above >= 95 * n;
    });
    ASSERT_EQ(*maximum.value(), *enough) << n;
  }
}

/// Returns the pixels that a fixed white level keeps.
cv::Mat1b keptWith(const cv::Mat1f& confidence, double white) {
  const cv::Mat1f none(confidence.size(), -1.0F);
  DepthExtractionOptions options;
  options.max_confidence = MaxConfidence::of(white);
  return extractAsPaper({confidence, cv::Mat1i::zeros(confidence.size()), none, none},
                        DepthPlanes(), options)
             .depth > 0;
}

TEST(RobustMaximum, OfTheKeyframesSoFarIsTheWhiteLevelOfTheSequence) {
  const test::LongRecording recording(1, 1.0);
  FusionMapperOptions options = test::playedOptions();
  options.keyframe.extraction.extraction = ExtractionMethod::kPaper;
  options.policy.window_s = 0.05;
  options.policy.stride_s = 0.015;
  options.keyframe.extraction.max_confidence.level = WhiteLevel::kSequence;
  const test::Played played = test::play(recording, options, 0);
  EXPECT_GE(played.keyframes.size(), 22U) << "more than the nineteen that are a plain maximum";
  RobustMaximum maximum;
  int unlike_its_own = 0;
  for (const KeyframeDepthMap& keyframe : played.keyframes) {
    double largest = 0;
    cv::minMaxLoc(keyframe.map.confidence, nullptr, &largest);
    EXPECT_EQ(keyframe.max_confidence, largest);
    maximum.add(largest);
    const cv::Mat1b kept = keyframe.map.depth > 0;
    EXPECT_EQ(cv::countNonZero(kept != keptWith(keyframe.map.confidence, *maximum.value())), 0);
    if (cv::countNonZero(kept != keptWith(keyframe.map.confidence, largest)) > 0) ++unlike_its_own;
  }
  EXPECT_GT(unlike_its_own, 5) << "or the test would not tell";
}

cv::Mat1b randomMask(int width, int height, double share, std::mt19937& random) {
  cv::Mat1b mask(height, width);
  for (unsigned char& kept : mask) {
    kept = std::uniform_real_distribution<>(0, 1)(random) < share ? 1 : 0;
  }
  return mask;
}

/// Computes the median: collects and sorts each window.
std::vector<float> naiveMedian(const cv::Mat1b& mask, const std::vector<float>& values,
                               int window) {
  cv::Mat1f image = cv::Mat1f::zeros(mask.size());
  const SparseMask kept(mask);
  kept.forEach([&](std::size_t i, cv::Point at) { image(at) = values[i]; });
  std::vector<float> medians(values.size());
  kept.forEach([&](std::size_t i, cv::Point at) {
    std::vector<float> around;
    for (int y = at.y - window / 2; y <= at.y + window / 2; ++y) {
      for (int x = at.x - window / 2; x <= at.x + window / 2; ++x) {
        const bool inside = x >= 0 && y >= 0 && x < mask.cols && y < mask.rows;
        if (inside && mask(y, x) != 0) around.push_back(image(y, x));
      }
    }
    std::sort(around.begin(), around.end());
    medians[i] = around[(around.size() - 1) / 2];
  });
  return medians;
}

TEST(MaskedMedian, EqualsTheMedianOfTheSortedWindow) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 60; ++trial) {
    const int width = 1 + static_cast<int>(random() % 40);
    const int height = 1 + static_cast<int>(random() % 40);
    const double share = std::array<double, 4>{0.05, 0.3, 0.9, 1.0}[random() % 4];
    const cv::Mat1b mask = randomMask(width, height, share, random);
    std::vector<float> values(static_cast<std::size_t>(cv::countNonZero(mask)));
    // Some trials have few different values, so that many are equal. Values have both signs.
    const float spread = trial % 2 == 0 ? 3.0F : 1e6F;
    for (float& value : values) {
      value = std::floor(std::uniform_real_distribution<float>(-spread, spread)(random)) / 2;
    }
    for (const int window : {1, 3, 5, 11, 31, 255}) {
      EXPECT_EQ(maskedMedian(SparseMask(mask), values, window), naiveMedian(mask, values, window))
          << width << "x" << height << ", window " << window;
    }
  }
}

}  // namespace

}  // namespace efm::depth_extraction_test
