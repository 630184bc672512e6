// SPDX-License-Identifier: BSD-3-Clause
// Depth extraction against its steps written down one by one: the same, bit for bit.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <sstream>

#include "mapping/depth/paper_extraction.h"
#include "test/mapping/depth/same_image.h"
#include "test/oracle/naive_depth.h"

namespace efm::paper_extraction_oracle_test {
namespace {

constexpr int kPlanes = 60;

DsiPeaks emptyPeaks(cv::Size size) {
  return {cv::Mat1f::zeros(size), cv::Mat1i::zeros(size), cv::Mat1f(size, -1.0F),
          cv::Mat1f(size, -1.0F)};
}

/// Fills in the neighbours of a peak as a DSI would: none beyond the first and the last plane.
void setPeak(DsiPeaks& peaks, cv::Point at, int plane, std::mt19937& random) {
  const float peak = peaks.confidence(at);
  const auto below = [&] { return peak * std::uniform_real_distribution<float>(0.5F, 1)(random); };
  peaks.plane(at) = plane;
  peaks.before(at) = plane == 0 ? -1.0F : below();
  peaks.after(at) = plane == kPlanes - 1 ? -1.0F : below();
}

/// Nothing like a scene: every pixel has its own confidence and plane.
DsiPeaks noisePeaks(cv::Size size, std::uint32_t seed) {
  std::mt19937 random(seed);
  DsiPeaks peaks = emptyPeaks(size);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      peaks.confidence(y, x) = std::exponential_distribution<float>(0.2F)(random);
      setPeak(peaks, {x, y}, static_cast<int>(random() % kPlanes), random);
    }
  }
  return peaks;
}

/// Ridges of votes along slanted edges over a low floor, as a keyframe has them.
DsiPeaks ridgePeaks(cv::Size size, std::uint32_t seed) {
  std::mt19937 random(seed);
  DsiPeaks peaks = emptyPeaks(size);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const double phase = 0.21 * x + 0.08 * y;
      const double ridge = std::exp(-8 * std::pow(std::sin(phase), 2));
      // Whole votes, so that some neighbours are equal.
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
        options.dilate = median == 5 || median == 255;
        options.subplane = median != 3;
        all.push_back(options);
      }
    }
  }
  return all;
}

void expectSame(const DsiPeaks& peaks, const DepthExtractionOptions& options) {
  const DepthPlanes planes({0.5, 5.0, kPlanes, PlaneSpacing::kInverse});
  const cv::Mat1f confidence = peaks.confidence.clone();
  const DepthMap actual = extractAsPaper(peaks, planes, options);
  const DepthMap expected = oracle::extractDepth(peaks, planes, options);
  EXPECT_TRUE(test::same(actual.depth, expected.depth));
  EXPECT_TRUE(test::same(actual.confidence, expected.confidence));
  EXPECT_TRUE(test::same(actual.variance, expected.variance));
  EXPECT_TRUE(test::same(peaks.confidence, confidence)) << "the peaks are left alone";
}

std::string described(cv::Size size, const DepthExtractionOptions& options) {
  std::ostringstream words;
  words << size << ", kernel " << options.threshold_kernel << ", C " << options.threshold_c
        << ", median " << options.median_size << (options.dilate ? ", dilated" : "");
  return words.str();
}

TEST(DepthExtractionOracle, AnySizeAndOptionsGiveTheSame) {
  for (const cv::Size& size : {cv::Size(1, 1), {5, 1}, {1, 6}, {4, 4}, {5, 5}, {17, 9}, {33, 31}}) {
    for (const DepthExtractionOptions& options : manyOptions()) {
      SCOPED_TRACE(described(size, options));
      expectSame(noisePeaks(size, 1), options);
      expectSame(ridgePeaks(size, 2), options);
      expectSame(emptyPeaks(size), options);
    }
  }
}

TEST(DepthExtractionOracle, AKeyframeOfRidgesGivesTheSame) {
  const cv::Size size(173, 131);
  for (const int median : {1, 5, 15}) {
    for (const bool dilate : {false, true}) {
      DepthExtractionOptions options;
      options.median_size = median;
      options.dilate = dilate;
      SCOPED_TRACE(described(size, options));
      expectSame(ridgePeaks(size, 3), options);
    }
  }
}

}  // namespace
}  // namespace efm::paper_extraction_oracle_test
