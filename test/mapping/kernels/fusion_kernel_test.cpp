// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "mapping/kernels/kernels.h"

namespace efm::kernels {
namespace {

constexpr float kUntouched = -7;

struct Rule {
  const char* name;
  FusionSteps FusionFunctions::*steps;
  const FusionSteps& operator*() const { return fusionFunctions().*steps; }
};

constexpr Rule kRules[] = {
    {"min", &FusionFunctions::min},
    {"harmonic", &FusionFunctions::harmonic},
    {"geometric", &FusionFunctions::geometric},
    {"arithmetic", &FusionFunctions::arithmetic},
    {"rms", &FusionFunctions::rms},
    {"max", &FusionFunctions::max},
};

/// From 10^min to 10^max, some zero and some subnormal.
std::vector<float> randomValues(std::mt19937& random, std::size_t n, double min, double max) {
  std::uniform_real_distribution<double> exponent(min, max);
  std::vector<float> values(n);
  for (float& value : values) {
    const auto kind = random() % 8;
    value = kind == 0 ? 0.0F
            : kind == 1
                ? std::numeric_limits<float>::denorm_min() * static_cast<float>(random() % 9)
                : static_cast<float>(std::pow(10.0, exponent(random)));
  }
  return values;
}

std::vector<float> pairOf(const Rule& rule, std::vector<float> a, const std::vector<float>& b) {
  (*rule).pair(a.data(), b.data(), a.size());
  return a;
}

std::vector<float> meanOf(const Rule& rule, const std::vector<float>& a,
                          const std::vector<float>& b) {
  std::vector<float> mean(a.size(), (*rule).start);
  (*rule).fold(mean.data(), a.data(), a.size());
  (*rule).fold(mean.data(), b.data(), a.size());
  (*rule).finish(mean.data(), 2, a.size());
  return mean;
}

TEST(FusionKernel, TouchesNoVoxelsButItsOwn) {
  for (const Rule& rule : kRules) {
    for (std::size_t n = 0; n < 40; ++n) {
      const std::vector<float> ones(n + 1, 1.0F);
      std::vector<float> values(n + 1, kUntouched);
      (*rule).pair(values.data(), ones.data(), n);
      (*rule).fold(values.data(), ones.data(), n);
      (*rule).finish(values.data(), 3, n);
      ASSERT_EQ(values.back(), kUntouched) << rule.name << ", " << n;
    }
  }
}

TEST(FusionKernel, TheMeanOfTwoIsThatOfTheirSum) {
  std::mt19937 random(3);
  const std::vector<float> a = randomValues(random, 1000, -6, 6);
  const std::vector<float> b = randomValues(random, 1000, -6, 6);
  for (const Rule& rule : kRules) {
    const std::vector<float> pair = pairOf(rule, a, b);
    const std::vector<float> mean = meanOf(rule, a, b);
    for (std::size_t i = 0; i < a.size(); ++i) {
      // A subnormal has no reciprocal. A logarithm is up to 90, which its exponential multiplies
      // the rounding by.
      ASSERT_NEAR(pair[i], mean[i], 2e-5 * mean[i] + 1e-37)
          << rule.name << " of " << a[i] << " and " << b[i];
    }
  }
}

TEST(FusionKernel, AndLikeMeansOfZeroAreExactlyZeroAlsoBesideASubnormal) {
  const float tiny = std::numeric_limits<float>::denorm_min();
  const std::vector<float> a = {0, 0, 5, tiny, tiny, 0};
  const std::vector<float> b = {0, 5, 0, 5, tiny, tiny};
  EXPECT_EQ(meanOf(kRules[1], a, b), std::vector<float>(6, 0.0F));
  EXPECT_EQ(pairOf(kRules[1], a, b), (std::vector<float>{0, 0, 0, 2 * tiny, 0, 0}));
  EXPECT_EQ(meanOf(kRules[2], {0, 0, 5}, {0, 5, 0}), std::vector<float>(3, 0.0F));
  EXPECT_EQ(pairOf(kRules[2], {0, 0, 5}, {0, 5, 0}), std::vector<float>(3, 0.0F));
}

}  // namespace
}  // namespace efm::kernels
