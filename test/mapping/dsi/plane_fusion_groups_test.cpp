// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "mapping/dsi/plane_fusion.h"
#include "mapping/kernels/tile_pixels.h"
#include "test/oracle/naive_mapper.h"

namespace efm {
namespace {

/// Full vectors of any instruction set, and a rest.
constexpr std::size_t kVoxels = 35;
constexpr float kSlack = 1e-4F;  ///< Of two folds and a sum in floats.

/// Ray densities of one plane: [camera][group * slots + slot][voxel].
struct Densities {
  FusionInputs inputs;
  std::vector<std::vector<PlaneValues>> values;

  const PlaneValues& at(int camera, int slot) const {
    return values[static_cast<std::size_t>(camera)][static_cast<std::size_t>(slot)];
  }
  PlaneFusion::Vote vote() const {
    return [this](int camera, int slot, PlaneValues& votes) { votes = at(camera, slot); };
  }
  /// One group by itself.
  Densities group(int g) const {
    Densities alone{{inputs.cameras, inputs.slots, 1}, {}};
    for (const auto& camera : values) {
      alone.values.emplace_back(camera.begin() + g * inputs.slots,
                                camera.begin() + (g + 1) * inputs.slots);
    }
    return alone;
  }
};

/// Zero in one voxel out of eight, else anything from 1e-2 to 1e2.
Densities randomDensities(std::mt19937& random, const FusionInputs& inputs) {
  std::uniform_real_distribution<double> exponent(-2, 2);
  Densities densities{inputs, {}};
  for (int camera = 0; camera < inputs.cameras; ++camera) {
    auto& of_camera = densities.values.emplace_back();
    for (int slot = 0; slot < inputs.slots * inputs.groups; ++slot) {
      PlaneValues& values = of_camera.emplace_back(kVoxels);
      for (float& value : values) {
        value = random() % 8 == 0 ? 0.0F : static_cast<float>(std::pow(10.0, exponent(random)));
      }
    }
  }
  return densities;
}

void forEachInput(std::uint32_t seed, const std::function<void(const Densities&)>& check) {
  std::mt19937 random(seed);
  for (int cameras = 1; cameras <= 4; ++cameras) {
    for (const int slots : {1, 2, 3}) {
      for (const int groups : {1, 2, 4, 5}) {
        SCOPED_TRACE(testing::Message()
                     << cameras << " cameras, " << slots << " slots, " << groups << " groups");
        check(randomDensities(random, {cameras, slots, groups}));
      }
    }
  }
}

void forEachChoice(const std::function<void(const FusionOptions&)>& check) {
  for (const FusionOrder order : {FusionOrder::kCamerasThenTime, FusionOrder::kTimeThenCameras}) {
    for (const FusionRule cameras : allFusionRules()) {
      for (const FusionRule time : allFusionRules()) {
        SCOPED_TRACE(testing::Message()
                     << nameOf(cameras) << ", " << nameOf(time) << ", " << nameOf(order));
        check({cameras, time, order});
      }
    }
  }
}

PlaneFusion fusionOf(const Densities& densities, const FusionOptions& options, VotingKernel kernel,
                     PlaneFusion::Keep keep = PlaneFusion::Keep::kFusedOnly) {
  return {options, densities.inputs, kVoxels, keep, kernel};
}

PlaneValues fuse(const Densities& densities, const FusionOptions& options, VotingKernel kernel) {
  return fusionOf(densities, options, kernel).fuse(densities.vote());
}

/// From a sum of floats that begins with nothing.
PlaneValues sumOf(const std::vector<PlaneValues>& terms) {
  PlaneValues sum(kVoxels, 0.0F);
  for (const PlaneValues& term : terms) {
    for (std::size_t i = 0; i < kVoxels; ++i) sum[i] += term[i];
  }
  return sum;
}

bool sameBits(const PlaneValues& a, const PlaneValues& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

class FusionOfGroupsOn : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, FusionOfGroupsOn, ::testing::ValuesIn(availableKernels()),
                         [](const auto& test) { return std::string(nameOf(test.param)); });

TEST_P(FusionOfGroupsOn, IsTheOraclesSumOfGroupsUnderAllRulesAndOrders) {
  forEachInput(1, [](const Densities& densities) {
    forEachChoice([&](const FusionOptions& options) {
      const PlaneValues fused = fuse(densities, options, GetParam());
      for (std::size_t i = 0; i < kVoxels; ++i) {
        double exact = 0;
        for (int group = 0; group < densities.inputs.groups; ++group) {
          std::vector<std::vector<double>> values;
          for (const auto& camera : densities.group(group).values) {
            auto& of_camera = values.emplace_back();
            for (const PlaneValues& slot : camera) of_camera.push_back(slot[i]);
          }
          exact += oracle::fuse(options, values);
        }
        ASSERT_NEAR(fused[i], exact, kSlack * exact) << "voxel " << i;
      }
    });
  });
}

TEST_P(FusionOfGroupsOn, IsTheSumOfEachGroupFusedAloneBitForBit) {
  forEachInput(2, [](const Densities& densities) {
    forEachChoice([&](const FusionOptions& options) {
      std::vector<PlaneValues> alone;
      for (int group = 0; group < densities.inputs.groups; ++group) {
        alone.push_back(fuse(densities.group(group), options, GetParam()));
      }
      ASSERT_TRUE(sameBits(fuse(densities, options, GetParam()), sumOf(alone)));
    });
  });
}

TEST_P(FusionOfGroupsOn, KeepsCamerasThatAreSumsOfTheirGroupsAndChangeNothing) {
  forEachInput(3, [](const Densities& densities) {
    forEachChoice([&](const FusionOptions& options) {
      PlaneFusion fusion = fusionOf(densities, options, GetParam(), PlaneFusion::Keep::kCameras);
      const PlaneValues fused = fusion.fuse(densities.vote());
      ASSERT_TRUE(sameBits(fused, fuse(densities, options, GetParam())));
      for (int camera = 0; camera < densities.inputs.cameras; ++camera) {
        std::vector<PlaneValues> alone;
        for (int group = 0; group < densities.inputs.groups; ++group) {
          Densities of_group = densities.group(group);
          of_group.inputs.cameras = 1;
          of_group.values = {of_group.values[static_cast<std::size_t>(camera)]};
          alone.push_back(fuse(of_group, options, GetParam()));
        }
        ASSERT_TRUE(sameBits(fusion.ofCamera(camera), sumOf(alone))) << "camera " << camera;
      }
    });
  });
}

TEST_P(FusionOfGroupsOn, LeavesNothingForTheNextPlane) {
  std::mt19937 random(4);
  for (const FusionInputs inputs : {FusionInputs{2, 1, 4}, {3, 2, 2}, {1, 3, 2}}) {
    const Densities first = randomDensities(random, inputs);
    const Densities second = randomDensities(random, inputs);
    forEachChoice([&](const FusionOptions& options) {
      PlaneFusion fusion = fusionOf(first, options, GetParam(), PlaneFusion::Keep::kCameras);
      fusion.fuse(first.vote());
      PlaneFusion fresh = fusionOf(first, options, GetParam(), PlaneFusion::Keep::kCameras);
      EXPECT_TRUE(sameBits(fusion.fuse(second.vote()), fresh.fuse(second.vote())));
      EXPECT_TRUE(sameBits(fusion.ofCamera(0), fresh.ofCamera(0)));
    });
  }
}

TEST_P(FusionOfGroupsOn, AsksForEveryInputOfEveryGroupOnce) {
  for (const FusionOrder order : {FusionOrder::kCamerasThenTime, FusionOrder::kTimeThenCameras}) {
    std::vector<int> asked(3 * 2 * 4);
    PlaneFusion fusion({FusionRule::kMin, FusionRule::kMax, order}, {3, 2, 4}, kVoxels,
                       PlaneFusion::Keep::kFusedOnly, GetParam());
    fusion.fuse([&](int camera, int slot, PlaneValues&) {
      ++asked.at(static_cast<std::size_t>(8 * camera + slot));
    });
    EXPECT_THAT(asked, ::testing::Each(1));
  }
}

TEST(FusionOfGroups, HarmonicOfSumsIsAtLeastTheSumAndTheSameWhereCamerasAgree) {
  std::mt19937 random(5);
  Densities densities = randomDensities(random, {2, 1, 4});
  const auto whole = [](const Densities& split) {
    Densities all{{2, 1, 1}, {}};
    for (const auto& camera : split.values) all.values.push_back({sumOf(camera)});
    return all;
  };
  const FusionOptions harmonic;
  const VotingKernel kernel = VotingKernel::kPlain;
  const PlaneValues split = fuse(densities, harmonic, kernel);
  const PlaneValues together = fuse(whole(densities), harmonic, kernel);
  for (std::size_t i = 0; i < kVoxels; ++i) EXPECT_GE(together[i], split[i] * (1 - kSlack));
  densities.values[1] = densities.values[0];
  const PlaneValues agreed = fuse(densities, harmonic, kernel);
  for (std::size_t i = 0; i < kVoxels; ++i) {
    EXPECT_NEAR(agreed[i], sumOf(densities.values[0])[i], kSlack * agreed[i]);
  }
}

/// Two inputs on a tile of any width, and some of its blocks.
TEST_P(FusionOfGroupsOn, APairIsAddedInItsBlocksAndNowhereElse) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> uniform(0, 9);
  for (const FusionRule rule : allFusionRules()) {
    for (const int width : {1, 7, 16, 17, 33, 48, 63}) {
      constexpr int kHeight = 5;
      const auto pixels = static_cast<std::size_t>(width * kHeight);
      FusionAccumulator mean(rule, pixels, GetParam());
      PlaneValues second(pixels);
      PlaneValues sum(pixels);
      for (std::size_t i = 0; i < pixels; ++i) {
        mean.place()[i] = random() % 4 == 0 ? 0 : uniform(random);
        second[i] = random() % 4 == 0 ? 0 : uniform(random);
        sum[i] = uniform(random);
      }
      kernels::PixelBlocks blocks;
      blocks.width = width;
      blocks.height = kHeight;
      std::vector<bool> inside(pixels);
      for (int y = 0; y < kHeight; ++y) {
        for (int block = 0; block * kernels::kBlockPixels < width; ++block) {
          if (random() % 2 == 0) continue;
          blocks.blocks[blocks.size++] =
              static_cast<std::uint32_t>(kernels::kBlocksInRow * y + block);
          for (int x = block * kernels::kBlockPixels;
               x < std::min(width, (block + 1) * kernels::kBlockPixels); ++x) {
            inside[static_cast<std::size_t>(y * width + x)] = true;
          }
        }
      }
      const PlaneValues before = sum;
      mean.addPair(second.data(), blocks, sum);
      for (std::size_t i = 0; i < pixels; ++i) {
        if (!inside[i]) {
          ASSERT_EQ(sum[i], before[i]) << nameOf(rule) << ", " << width << " wide, pixel " << i;
          continue;
        }
        const double exact = before[i] + oracle::fuse(rule, {mean.values()[i], second[i]});
        ASSERT_NEAR(sum[i], exact, 1e-6 * exact)
            << nameOf(rule) << ", " << width << " wide, pixel " << i;
      }
    }
  }
}

}  // namespace
}  // namespace efm
