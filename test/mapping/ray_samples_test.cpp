// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/kernels/ray_samples.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

#include "mapping/kernels/vote.h"
#include "mapping/kernels/weighted_vote.h"

namespace efm::kernels {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::FloatEq;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

std::uint16_t upperHalf(float value) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof(bits));
  return static_cast<std::uint16_t>(bits >> 16U);
}

/// A plane and rays, from one seed: in the view and around it, some behind the camera.
struct RandomSamples {
  int width = 37;
  int height = 23;
  std::vector<std::uint16_t> values;
  std::vector<float> x, y, dx, dy, limit;

  explicit RandomSamples(std::uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> share(0, 1);
    for (int i = 0; i < width * height; ++i) values.push_back(upperHalf(100 * share(random)));
    for (std::size_t i = 0; i < 40 * kRayBlock; ++i) {
      x.push_back((1.4F * share(random) - 0.2F) * static_cast<float>(width));
      y.push_back((1.4F * share(random) - 0.2F) * static_cast<float>(height));
      dx.push_back(10 * share(random) - 5);
      dy.push_back(10 * share(random) - 5);
      limit.push_back(share(random) < 0.8F ? kInfinity : 4 * share(random) - 2);
    }
    x[3] = kNan;
    y[5] = kInfinity;
    limit[7] = -kInfinity;
  }
  SlopedRays rays() const {
    return {x.data(), y.data(), dx.data(), dy.data(), limit.data(), x.size()};
  }
  SampledPlane plane() const { return {values.data(), width, height, 0.7F}; }
};

struct Sampled {
  std::vector<float> values, sums;
};

Sampled sample(const RaySampleFunctions& functions, const RandomSamples& input, SamplePower power) {
  Sampled sampled{std::vector<float>(input.x.size(), -1), std::vector<float>(input.x.size(), 2)};
  functions.sample(input.rays(), input.plane(), power, sampled.values.data(), sampled.sums.data());
  return sampled;
}

TEST(RaySamples, AreBilinearAndZeroWhereNoVoteIsCast) {
  const std::vector<std::uint16_t> values = {upperHalf(1), upperHalf(3), upperHalf(5),
                                             upperHalf(7), upperHalf(9), upperHalf(11)};
  const SampledPlane plane{values.data(), 3, 2, 0.5F};
  // The last two see the plane behind them: 0.5 is not below 0.5, and -0.5 not below -0.5.
  std::vector<float> x = {0, 0.5F, 1, 2, 0, 0, 0.25F, 0, 0};
  std::vector<float> y = {0, 0.5F, 0, 0, 1, 0.5F, 0, 0, 0};
  std::vector<float> dx = {0, 0, 1, 0, 0, -0.1F, 0, 0, 0};
  std::vector<float> limit = {1, 1, 1, 1, 1, 1, -0.25F, 0.5F, -0.5F};
  for (std::vector<float>* part : {&x, &y, &dx, &limit}) part->resize(kRayBlock, kNan);
  const std::vector<float> dy(kRayBlock, 0);
  for (const VotingKernel kernel : runnableKernels()) {
    std::vector<float> sampled(kRayBlock, -1);
    std::vector<float> sums(kRayBlock, 1);
    const SlopedRays rays{x.data(), y.data(), dx.data(), dy.data(), limit.data(), kRayBlock};
    raySampleFunctions(kernel).sample(rays, plane, SamplePower::kTwo, sampled.data(), sums.data());
    EXPECT_THAT(std::vector<float>(sampled.begin(), sampled.begin() + 9),
                ElementsAre(1, 25, 16, 0, 0, 0, 2.25F, 0, 0));
    EXPECT_THAT(std::vector<float>(sampled.begin() + 9, sampled.end()), Each(0));
    EXPECT_EQ(sums[1], 26);
  }
}

TEST(RaySamples, EveryKernelSamplesAsThePlainOne) {
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    const RandomSamples input(seed);
    for (const SamplePower power : {SamplePower::kOne, SamplePower::kTwo}) {
      const Sampled plain = sample(plainRaySamples(), input, power);
      for (const VotingKernel kernel : runnableKernels()) {
        const Sampled fast = sample(raySampleFunctions(kernel), input, power);
        for (std::size_t i = 0; i < plain.values.size(); ++i) {
          EXPECT_NEAR(fast.values[i], plain.values[i], 1e-3F * (1 + plain.values[i])) << i;
          EXPECT_FLOAT_EQ(fast.sums[i], 2 + fast.values[i]);
        }
      }
    }
  }
}

TEST(RaySamples, EveryKernelFindsWhatReachesItsThreshold) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> few(0, 3);
  for (const std::size_t n : {kRayBlock, 5 * kRayBlock}) {
    std::vector<float> values, thresholds;
    std::vector<std::uint32_t> expected;
    for (std::size_t i = 0; i < n; ++i) {
      values.push_back(static_cast<float>(few(random)));
      thresholds.push_back(i % 7 == 0 ? kInfinity : static_cast<float>(few(random)));
      if (values[i] >= thresholds[i]) expected.push_back(static_cast<std::uint32_t>(i));
    }
    for (const VotingKernel kernel : runnableKernels()) {
      std::vector<std::uint32_t> found(n + kRayBlock);
      found.resize(
          raySampleFunctions(kernel).find_large(values.data(), thresholds.data(), n, found.data()));
      EXPECT_EQ(found, expected);
    }
  }
}

TEST(WeightedVotes, OfWeightOneAreThePlainVotes) {
  const RandomSamples input(2);
  std::vector<float> plain(static_cast<std::size_t>(input.width * input.height));
  std::vector<float> weighted = plain;
  std::vector<float> half = plain;
  std::vector<WeightedVote> votes, half_votes;
  for (std::size_t i = 0; i < input.x.size(); ++i) {
    votes.push_back({input.x[i], input.y[i], 1});
    half_votes.push_back({input.x[i], input.y[i], 0.5F});
  }
  votePlain({input.x.data(), input.y.data()}, {0, input.x.size(), 1, 0, 0},
            {plain.data(), input.width, input.height});
  voteWeighted(votes.data(), votes.size(),
               {weighted.data(), 0, input.height, input.width, input.height});
  voteWeighted(half_votes.data(), votes.size(),
               {half.data(), 0, input.height, input.width, input.height});
  for (std::size_t i = 0; i < plain.size(); ++i) {
    EXPECT_NEAR(weighted[i], plain[i], 1e-5F);
    EXPECT_NEAR(half[i], 0.5F * plain[i], 1e-5F);
  }
}

TEST(WeightedVotes, OnRowsAreThoseOfTheWholePlane) {
  const RandomSamples input(3);
  const auto width = static_cast<std::size_t>(input.width);
  std::vector<WeightedVote> votes;
  for (std::size_t i = 0; i < input.x.size(); ++i) {
    votes.push_back({input.x[i], input.y[i], input.dx[i]});
  }
  std::vector<float> whole(width * static_cast<std::size_t>(input.height));
  std::vector<float> joined(whole.size());
  voteWeighted(votes.data(), votes.size(),
               {whole.data(), 0, input.height, input.width, input.height});
  constexpr int kCount = 5;
  for (int first = 0; first < input.height; first += kCount) {
    voteWeighted(votes.data(), votes.size(),
                 {joined.data() + static_cast<std::size_t>(first) * width, first,
                  std::min(kCount, input.height - first), input.width, input.height});
  }
  EXPECT_EQ(joined, whole);
}

}  // namespace
}  // namespace efm::kernels
