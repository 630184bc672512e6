// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "mapping/dsi/voting_kernel.h"
#include "mapping/kernels/fusion.h"

namespace efm::kernels {
namespace {

constexpr float kUntouched = -7;

struct Rule {
  const char* name;
  FusionSteps FusionFunctions::*steps;
  bool same_bits;       ///< Of sums and means by all kernels.
  bool same_pair_bits;  ///< Of the mean of two.
};

constexpr Rule kRules[] = {
    {"min", &FusionFunctions::min, true, true},
    {"harmonic", &FusionFunctions::harmonic, true, true},
    {"geometric", &FusionFunctions::geometric, false, true},
    {"arithmetic", &FusionFunctions::arithmetic, true, true},
    {"rms", &FusionFunctions::rms, false, false},
    {"max", &FusionFunctions::max, true, true},
};

/// Values that end with the memory that a kernel may touch, so that sanitizers see what lies
/// beyond, after a start that alignment does not favour.
class Values {
 public:
  explicit Values(std::vector<float> values) : memory_(std::move(values)) {
    memory_.insert(memory_.begin(), kUntouched);
    memory_.push_back(kUntouched);
  }
  float* data() { return memory_.data() + 1; }
  std::vector<float> values() const { return {memory_.begin() + 1, memory_.end() - 1}; }
  bool intactAround() const {
    return memory_.front() == kUntouched && memory_.back() == kUntouched;
  }

 private:
  std::vector<float> memory_;
};

/// Zero, subnormal, and from 1e-37 to 1e18, whose square is a float.
std::vector<float> randomValues(std::mt19937& random, std::size_t n) {
  std::uniform_real_distribution<double> exponent(-37, 18);
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

bool sameBits(const std::vector<float>& a, const std::vector<float>& b) {
  const std::size_t bytes = a.size() * sizeof(float);
  return a.size() == b.size() && (bytes == 0 || std::memcmp(a.data(), b.data(), bytes) == 0);
}

/// The three steps of a rule by themselves.
struct Outcome {
  std::vector<float> sum;
  std::vector<float> mean;
  std::vector<float> pair;
};

Outcome outcomeOf(const FusionSteps& steps, const std::vector<float>& a,
                  const std::vector<float>& b) {
  Values sum(std::vector<float>(a.size(), steps.start));
  Values first(a);
  Values second(b);
  steps.fold(sum.data(), first.data(), a.size());
  steps.fold(sum.data(), second.data(), a.size());
  Values mean(sum.values());
  steps.finish(mean.data(), 2, a.size());
  Values pair(a);
  steps.pair(pair.data(), second.data(), a.size());
  for (const Values* values : {&sum, &first, &second, &mean, &pair}) {
    EXPECT_TRUE(values->intactAround()) << a.size();
  }
  return {sum.values(), mean.values(), pair.values()};
}

class FusionKernel : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, FusionKernel, ::testing::ValuesIn(availableKernels()),
                         [](const auto& test) { return std::string(nameOf(test.param)); });

TEST_P(FusionKernel, GivesThePlainBitsForAnyNumberOfVoxelsAndTouchesNoOthers) {
  std::mt19937 random(1);
  for (const Rule& rule : kRules) {
    const FusionSteps& fast = fusionFunctions(GetParam()).*rule.steps;
    const FusionSteps& plain = plainFusion().*rule.steps;
    for (std::size_t n = 0; n < 70; ++n) {
      const auto a = randomValues(random, n);
      const auto b = randomValues(random, n);
      const Outcome of_fast = outcomeOf(fast, a, b);
      const Outcome of_plain = outcomeOf(plain, a, b);
      if (rule.same_bits) {
        ASSERT_TRUE(sameBits(of_fast.sum, of_plain.sum)) << rule.name << ", " << n << " voxels";
        ASSERT_TRUE(sameBits(of_fast.mean, of_plain.mean)) << rule.name << ", " << n << " voxels";
      }
      if (rule.same_pair_bits) {
        ASSERT_TRUE(sameBits(of_fast.pair, of_plain.pair)) << rule.name << ", " << n << " voxels";
      }
    }
  }
}

TEST_P(FusionKernel, AVoxelsResultDependsNeitherOnItsPlaceNorOnTheirNumber) {
  std::mt19937 random(2);
  const auto a = randomValues(random, 64);
  const auto b = randomValues(random, 64);
  for (const Rule& rule : kRules) {
    const FusionSteps& steps = fusionFunctions(GetParam()).*rule.steps;
    const Outcome all = outcomeOf(steps, a, b);
    for (std::size_t i = 0; i < a.size(); ++i) {
      const Outcome one = outcomeOf(steps, {a[i]}, {b[i]});
      ASSERT_TRUE(
          sameBits({all.sum[i], all.mean[i], all.pair[i]}, {one.sum[0], one.mean[0], one.pair[0]}))
          << rule.name << " of " << a[i] << " and " << b[i];
    }
  }
}

TEST_P(FusionKernel, TheMeanOfTwoIsThatOfTheirSum) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> exponent(-6, 6);
  std::vector<float> a(1000);
  std::vector<float> b(1000);
  for (float& value : a) value = static_cast<float>(std::pow(10.0, exponent(random)));
  for (float& value : b) value = static_cast<float>(std::pow(10.0, exponent(random)));
  for (const Rule& rule : kRules) {
    const Outcome outcome = outcomeOf(fusionFunctions(GetParam()).*rule.steps, a, b);
    for (std::size_t i = 0; i < a.size(); ++i) {
      // A logarithm is up to 14, which its exponential multiplies the rounding by.
      ASSERT_NEAR(outcome.pair[i], outcome.mean[i], 4e-6 * outcome.mean[i])
          << rule.name << " of " << a[i] << " and " << b[i];
    }
  }
}

TEST_P(FusionKernel, AMeanOfTwoIsNeverBelowTheSmallerNorAboveTheLarger) {
  std::mt19937 random(4);
  const auto a = randomValues(random, 4000);
  const auto b = randomValues(random, 4000);
  for (const Rule& rule : kRules) {
    const auto pair = outcomeOf(fusionFunctions(GetParam()).*rule.steps, a, b).pair;
    for (std::size_t i = 0; i < a.size(); ++i) {
      // Below the normal floats a mean may be lost; squares are below them from 1e-19 down.
      const double lost = rule.name == std::string("rms") ? 2e-19 : 2e-38;
      ASSERT_GE(pair[i], std::min(a[i], b[i]) * (1 - 3e-7) - lost) << rule.name;
      ASSERT_LE(pair[i], std::max(a[i], b[i]) * (1 + 3e-7) + lost) << rule.name;
    }
  }
}

TEST_P(FusionKernel, ZeroAndWhatHasNoReciprocalMakeAHarmonicMeanOfZero) {
  const float tiny = std::numeric_limits<float>::denorm_min();
  const FusionSteps& harmonic = fusionFunctions(GetParam()).harmonic;
  const Outcome outcome = outcomeOf(harmonic, {0, 0, 5, tiny, tiny, 0}, {0, 5, 0, 5, tiny, tiny});
  EXPECT_EQ(outcome.mean, std::vector<float>(6, 0.0F));
  EXPECT_EQ(outcome.pair, (std::vector<float>{0, 0, 0, 2 * tiny, 0, 0}));
}

TEST_P(FusionKernel, LogarithmsAndExponentialsAreWithinTheirBound) {
  const FusionSteps& geometric = fusionFunctions(GetParam()).geometric;
  double worst_log = 0;
  double worst_exp = 0;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> exponent(-80, 80);
  for (int i = 0; i < 200'000; ++i) {
    const auto x = static_cast<float>(exponent(random));
    float mean = x;
    geometric.finish(&mean, 1, 1);
    worst_exp = std::max(worst_exp, std::abs(mean / std::exp(static_cast<double>(x)) - 1));
    const float value = std::exp(x);
    float sum = 0;
    geometric.fold(&sum, &value, 1);
    const double log = std::log(static_cast<double>(value));
    worst_log = std::max(worst_log, std::abs(sum - log) / std::max(1.0, std::abs(log)));
  }
  EXPECT_LT(worst_log, 5e-7);
  EXPECT_LT(worst_exp, 5e-7);
}

TEST_P(FusionKernel, ZeroMakesAGeometricMeanExactlyZero) {
  const FusionSteps& geometric = fusionFunctions(GetParam()).geometric;
  const Outcome outcome = outcomeOf(geometric, {0, 0, 5}, {0, 5, 0});
  EXPECT_EQ(outcome.mean, std::vector<float>(3, 0.0F));
  EXPECT_EQ(outcome.pair, std::vector<float>(3, 0.0F));
}

}  // namespace
}  // namespace efm::kernels
