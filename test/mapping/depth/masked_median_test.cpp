// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/peak_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <random>

namespace efm::masked_median_test {
namespace {

cv::Mat1b randomMask(int width, int height, double share, std::mt19937& random) {
  cv::Mat1b mask(height, width);
  for (unsigned char& kept : mask) {
    kept = std::uniform_real_distribution<>(0, 1)(random) < share ? 1 : 0;
  }
  return mask;
}

/// Collects and sorts each window.
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
    // Few different ones in some trials, so that many are equal; of both signs.
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
}  // namespace efm::masked_median_test
