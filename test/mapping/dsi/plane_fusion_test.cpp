// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi/plane_fusion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <numeric>
#include <random>
#include <stdexcept>
#include <string>

#include "test/oracle/naive_mapper.h"

namespace efm {
namespace {

/// Full vectors of any instruction set, and a rest.
constexpr std::size_t kVoxels = 35;

/// A fold of n floats errs by at most n roundings of 6e-8, and log and exp multiply that by the
/// logarithm, here at most log 1e8 = 18.4: two folds of up to 8 inputs stay within 2e-5 each way.
constexpr double kRounding = 5e-5;

/// Ray densities of one plane: [camera][slot][voxel].
using Densities = std::vector<std::vector<PlaneValues>>;

/// Zero in one voxel out of eight, else anything from 1e-4 to 1e4.
Densities randomDensities(std::mt19937& random, int cameras, int slots) {
  std::uniform_real_distribution<double> exponent(-4, 4);
  Densities densities(static_cast<std::size_t>(cameras));
  for (auto& camera : densities) {
    camera.assign(static_cast<std::size_t>(slots), PlaneValues(kVoxels));
    for (auto& slot : camera) {
      for (float& value : slot) {
        value = random() % 8 == 0 ? 0.0F : static_cast<float>(std::pow(10.0, exponent(random)));
      }
    }
  }
  return densities;
}

PlaneFusion::Vote votesOf(const Densities& densities) {
  return [&densities](int camera, int slot, PlaneValues& votes) {
    votes = densities[static_cast<std::size_t>(camera)][static_cast<std::size_t>(slot)];
  };
}

PlaneFusion fusionOf(VotingKernel kernel, const Densities& densities, const FusionOptions& options,
                     PlaneFusion::Keep keep = PlaneFusion::Keep::kFusedOnly) {
  return {options,
          {static_cast<int>(densities.size()), static_cast<int>(densities[0].size())},
          kVoxels,
          keep,
          kernel};
}

PlaneValues fuse(VotingKernel kernel, const Densities& densities, const FusionOptions& options) {
  PlaneFusion fusion = fusionOf(kernel, densities, options);
  return fusion.fuse(votesOf(densities));
}

/// All pairs of rules in both orders.
void forEachChoice(const std::function<void(const FusionOptions&)>& check) {
  for (const FusionOrder order : {FusionOrder::kCamerasThenTime, FusionOrder::kTimeThenCameras}) {
    for (const FusionRule cameras : allFusionRules()) {
      for (const FusionRule time : allFusionRules()) check({cameras, time, order});
    }
  }
}

/// All numbers of cameras and slots that matter, with random densities.
void forEachInput(std::uint32_t seed, const std::function<void(const Densities&)>& check) {
  std::mt19937 random(seed);
  for (int cameras = 1; cameras <= 4; ++cameras) {
    for (int slots = 1; slots <= 8; ++slots) check(randomDensities(random, cameras, slots));
  }
}

std::string labelOf(const Densities& densities, const FusionOptions& options) {
  return std::to_string(densities.size()) + " cameras " +
         std::string(nameOf(options.across_cameras)) + ", " + std::to_string(densities[0].size()) +
         " slots " + std::string(nameOf(options.across_time)) + ", " +
         std::string(nameOf(options.order));
}

void expectNear(const PlaneValues& a, const PlaneValues& b, double relative,
                const std::string& label) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_NEAR(a[i], b[i], relative * static_cast<double>(std::max(a[i], b[i])))
        << label << ", voxel " << i;
  }
}

/// Every claim holds for every kernel that runs here.
class PlaneFusionOn : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, PlaneFusionOn, ::testing::ValuesIn(availableKernels()),
                         [](const auto& test) { return std::string(nameOf(test.param)); });

TEST_P(PlaneFusionOn, EveryPairOfRulesInEitherOrderIsTheOracles) {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    forEachInput(seed, [](const Densities& densities) {
      forEachChoice([&](const FusionOptions& options) {
        const PlaneValues fused = fuse(GetParam(), densities, options);
        ASSERT_EQ(fused.size(), kVoxels);
        for (std::size_t i = 0; i < kVoxels; ++i) {
          std::vector<std::vector<double>> values;
          for (const auto& camera : densities) {
            auto& of_camera = values.emplace_back();
            for (const auto& slot : camera) of_camera.push_back(slot[i]);
          }
          const double exact = oracle::fuse(options, values);
          ASSERT_NEAR(fused[i], exact, kRounding * exact) << labelOf(densities, options);
        }
      });
    });
  }
}

TEST_P(PlaneFusionOn, EqualRulesOnBothAxesAreOrderedAndBetweenTheExtremes) {
  forEachInput(11, [](const Densities& densities) {
    PlaneValues previous = fuse(GetParam(), densities, {FusionRule::kMin, FusionRule::kMin});
    for (const FusionRule rule : allFusionRules()) {  // min, H, G, A, RMS, max
      const PlaneValues fused = fuse(GetParam(), densities, {rule, rule});
      for (std::size_t i = 0; i < kVoxels; ++i) {
        ASSERT_GE(fused[i], previous[i] * (1 - kRounding)) << nameOf(rule);
      }
      previous = fused;
    }
  });
}

TEST_P(PlaneFusionOn, AHigherRuleOnEitherAxisNeverLowersTheResult) {
  const auto& rules = allFusionRules();
  forEachInput(12, [&](const Densities& densities) {
    forEachChoice([&](const FusionOptions& options) {
      const PlaneValues fused = fuse(GetParam(), densities, options);
      const auto check = [&](FusionOptions higher) {
        const PlaneValues raised = fuse(GetParam(), densities, higher);
        for (std::size_t i = 0; i < kVoxels; ++i) {
          ASSERT_GE(raised[i], fused[i] * (1 - kRounding)) << labelOf(densities, options);
        }
      };
      if (options.across_cameras != rules.back()) {
        FusionOptions higher = options;
        higher.across_cameras = rules[static_cast<std::size_t>(options.across_cameras) + 1];
        check(higher);
      }
      if (options.across_time != rules.back()) {
        FusionOptions higher = options;
        higher.across_time = rules[static_cast<std::size_t>(options.across_time) + 1];
        check(higher);
      }
    });
  });
}

TEST_P(PlaneFusionOn, NeitherTheOrderOfCamerasNorThatOfSlotsMatters) {
  std::mt19937 random(13);
  forEachInput(13, [&](const Densities& densities) {
    Densities permuted = densities;
    std::shuffle(permuted.begin(), permuted.end(), random);
    std::vector<std::size_t> slots(densities[0].size());
    std::iota(slots.begin(), slots.end(), 0);
    std::shuffle(slots.begin(), slots.end(), random);
    for (auto& camera : permuted) {
      const auto before = camera;
      for (std::size_t s = 0; s < slots.size(); ++s) camera[s] = before[slots[s]];
    }
    forEachChoice([&](const FusionOptions& options) {
      expectNear(fuse(GetParam(), permuted, options), fuse(GetParam(), densities, options),
                 kRounding, labelOf(densities, options));
    });
  });
}

TEST_P(PlaneFusionOn, EqualInputsAreTheirOwnMean) {
  forEachInput(14, [](const Densities& densities) {
    Densities equal = densities;
    for (auto& camera : equal) {
      for (auto& slot : camera) slot = densities[0][0];
    }
    forEachChoice([&](const FusionOptions& options) {
      expectNear(fuse(GetParam(), equal, options), densities[0][0], kRounding,
                 labelOf(densities, options));
    });
  });
}

TEST_P(PlaneFusionOn, TheSameRuleOnBothAxesCommutes) {
  forEachInput(15, [](const Densities& densities) {
    for (const FusionRule rule : allFusionRules()) {  // the paper's A_c A_t and H_c H_t, and more
      const FusionOptions cameras_first{rule, rule, FusionOrder::kCamerasThenTime};
      const FusionOptions time_first{rule, rule, FusionOrder::kTimeThenCameras};
      expectNear(fuse(GetParam(), densities, cameras_first),
                 fuse(GetParam(), densities, time_first), kRounding,
                 labelOf(densities, cameras_first));
    }
  });
}

TEST_P(PlaneFusionOn, DifferentRulesDoNotCommute) {
  const Densities densities = {{PlaneValues(kVoxels, 1), PlaneValues(kVoxels, 9)},
                               {PlaneValues(kVoxels, 4), PlaneValues(kVoxels, 1)}};
  const FusionRule h = FusionRule::kHarmonic;
  const FusionRule a = FusionRule::kArithmetic;
  // (H(1, 4) + H(9, 1)) / 2 = (1.6 + 1.8) / 2, and H(5, 2.5) = 10 / 3.
  EXPECT_FLOAT_EQ(fuse(GetParam(), densities, {h, a, FusionOrder::kCamerasThenTime})[0], 1.7F);
  EXPECT_FLOAT_EQ(fuse(GetParam(), densities, {h, a, FusionOrder::kTimeThenCameras})[0], 10.0F / 3);
}

bool sameBits(const PlaneValues& a, const PlaneValues& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

TEST_P(PlaneFusionOn, AnAxisOfOneInputIsLeftOutBitForBit) {
  std::mt19937 random(16);
  const Densities one = randomDensities(random, 1, 1);
  const Densities in_time = randomDensities(random, 1, 5);
  const Densities in_cameras = randomDensities(random, 3, 1);
  const auto folded = [](FusionRule rule, const std::vector<PlaneValues>& inputs) {
    FusionAccumulator accumulator(rule, kVoxels, GetParam());
    accumulator.begin(static_cast<int>(inputs.size()));
    for (const auto& input : inputs) accumulator.fold(input.data());
    accumulator.finish();
    return accumulator.values();
  };
  forEachChoice([&](const FusionOptions& options) {
    EXPECT_TRUE(sameBits(fuse(GetParam(), one, options), one[0][0])) << labelOf(one, options);
    EXPECT_TRUE(
        sameBits(fuse(GetParam(), in_time, options), folded(options.across_time, in_time[0])))
        << labelOf(in_time, options);
    EXPECT_TRUE(sameBits(
        fuse(GetParam(), in_cameras, options),
        folded(options.across_cameras, {in_cameras[0][0], in_cameras[1][0], in_cameras[2][0]})))
        << labelOf(in_cameras, options);
  });
}

TEST_P(PlaneFusionOn, KeptCamerasAreFusedAcrossTimeAloneAndChangeNothing) {
  forEachInput(17, [](const Densities& densities) {
    forEachChoice([&](const FusionOptions& options) {
      PlaneFusion fusion = fusionOf(GetParam(), densities, options, PlaneFusion::Keep::kCameras);
      const PlaneValues fused = fusion.fuse(votesOf(densities));
      ASSERT_TRUE(sameBits(fused, fuse(GetParam(), densities, options)))
          << labelOf(densities, options);
      for (std::size_t c = 0; c < densities.size(); ++c) {
        ASSERT_TRUE(sameBits(fusion.ofCamera(static_cast<int>(c)),
                             fuse(GetParam(), {densities[c]}, options)))
            << labelOf(densities, options);
      }
    });
  });
}

TEST_P(PlaneFusionOn, NothingIsLeftOverFromThePlaneBefore) {
  std::mt19937 random(18);
  const Densities first = randomDensities(random, 3, 4);
  const Densities second = randomDensities(random, 3, 4);
  forEachChoice([&](const FusionOptions& options) {
    PlaneFusion fusion = fusionOf(GetParam(), first, options, PlaneFusion::Keep::kCameras);
    fusion.fuse(votesOf(first));
    EXPECT_TRUE(sameBits(fusion.fuse(votesOf(second)), fuse(GetParam(), second, options)));
    EXPECT_TRUE(sameBits(fusion.ofCamera(2), fuse(GetParam(), {second[2]}, options)));
  });
}

TEST_P(PlaneFusionOn, AsksForEveryInputOnce) {
  for (const FusionOrder order : {FusionOrder::kCamerasThenTime, FusionOrder::kTimeThenCameras}) {
    std::vector<int> asked(3 * 4);
    PlaneFusion fusion({FusionRule::kMin, FusionRule::kMax, order}, {3, 4}, kVoxels,
                       PlaneFusion::Keep::kFusedOnly, GetParam());
    fusion.fuse([&](int camera, int slot, PlaneValues&) {
      ++asked[static_cast<std::size_t>(4 * camera + slot)];
    });
    EXPECT_THAT(asked, ::testing::Each(1));
  }
}

TEST(FusionOrder, NamesGoBothWays) {
  for (const FusionOrder order : {FusionOrder::kCamerasThenTime, FusionOrder::kTimeThenCameras}) {
    EXPECT_EQ(fusionOrderFromName(nameOf(order)), order);
  }
  EXPECT_THAT([] { fusionOrderFromName("both"); },
              ::testing::ThrowsMessage<std::invalid_argument>(::testing::AllOf(
                  ::testing::HasSubstr("'both'"), ::testing::HasSubstr("time_then_cameras"))));
}

}  // namespace
}  // namespace efm
