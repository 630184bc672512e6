// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <limits>
#include <vector>

#include "mapping/dsi/dsi_grid.h"
#include "mapping/kernels/kernels.h"
#include "test/kernels/self_test.h"

namespace efm::kernels {
namespace {

TEST(SelfTest, EveryKernelOfThisProcessorPasses) {
  for (const VotingKernel kernel : availableKernels()) {
    for (const std::uint32_t seed : {1U, 2U, 3U}) {
      EXPECT_THAT(selfTest(kernel, seed), ::testing::IsEmpty()) << nameOf(kernel) << ", " << seed;
    }
  }
}

struct Votes {
  std::vector<float> plane;
  std::uint64_t cast = 0;
};

/// Votes with one ray at (x, y) on a plane of 4 x 3 pixels.
Votes voteAt(float x, float y) {
  Votes result{std::vector<float>(12, 0.0F), 0};
  result.cast = voteBilinear({&x, &y}, {0, 1, 1, 0, 0}, {result.plane.data(), 4, 3});
  return result;
}

TEST(VotePlain, AVoteIsCastOnlyWhereAllFourPixelsAreInside) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(voteAt(0, 0).cast, 1U);
  EXPECT_EQ(voteAt(2.999F, 1.999F).cast, 1U);
  for (const auto& [x, y] : std::vector<std::pair<float, float>>{{-0.001F, 1},
                                                                 {1, -0.001F},
                                                                 {3, 1},
                                                                 {1, 2},
                                                                 {1e30F, 1},
                                                                 {-1e30F, 1},
                                                                 {kInfinity, 1},
                                                                 {1, -kInfinity},
                                                                 {kNan, 1},
                                                                 {1, kNan}}) {
    const Votes votes = voteAt(x, y);
    EXPECT_EQ(votes.cast, 0U) << x << ", " << y;
    EXPECT_THAT(votes.plane, ::testing::Each(0.0F)) << x << ", " << y;
  }
}

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
