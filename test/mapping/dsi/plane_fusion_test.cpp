// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "mapping/dsi/dsi_grid.h"
#include "mapping/dsi/plane_fusion.h"
#include "mapping/sweep/space_sweep.h"
#include "test/oracle/naive_mapper.h"

namespace efm {
namespace {

/// Draws ray densities like those of votes: not negative, some zero, up to a few thousand.
rc::Gen<float> density() {
  return rc::gen::oneOf(rc::gen::just(0.0F),
                        rc::gen::map(rc::gen::inRange(1, 4'000'000),
                                     [](int n) { return static_cast<float>(n) * 1e-3F; }));
}

rc::Gen<std::vector<float>> densities() {
  return rc::gen::mapcat(rc::gen::inRange<std::size_t>(1, 17), [](std::size_t n) {
    return rc::gen::container<std::vector<float>>(n, density());
  });
}

/// Returns the mean of planes with one value each: the same bits in all voxels, otherwise NaN.
/// @param in_place true if inputs are written to `next`.
float meanOf(FusionRule rule, const std::vector<float>& inputs, bool in_place,
             bool all_pairs = false) {
  constexpr std::size_t kVoxels = 37;  // not a multiple of any vector size
  FusionAccumulator accumulator(rule, static_cast<int>(inputs.size()), kVoxels, all_pairs);
  for (const float input : inputs) {
    PlaneValues own(kVoxels);
    PlaneValues& plane = in_place ? accumulator.next() : own;
    std::fill(plane.begin(), plane.end(), input);
    accumulator.add(plane);
  }
  EXPECT_TRUE(accumulator.isComplete());
  const PlaneValues& values = accumulator.mean();
  const bool same = std::all_of(values.begin(), values.end(),
                                [&](float value) { return value == values.front(); });
  return same ? values.front() : std::numeric_limits<float>::quiet_NaN();
}

/// A sum of n floats has an error of at most n roundings; log and exp add a few. The sum of 16
/// inputs of up to log 4000 = 8.3, exponentiated, stays within 16 * 16 * 8.3 * 6e-8 = 1.3e-4.
constexpr double kMeanRounding = 2e-4;

RC_GTEST_PROP(FusionRule, EveryRuleIsItsTextbookMean, ()) {
  const auto inputs = *densities();
  const std::vector<double> exact(inputs.begin(), inputs.end());
  for (const FusionRule rule : allFusionRules()) {
    const double expected = oracle::fuse(rule, exact);
    RC_ASSERT(std::abs(meanOf(rule, inputs, false) - expected) <= kMeanRounding * expected);
    RC_ASSERT(meanOf(rule, inputs, true) == meanOf(rule, inputs, false));
    RC_ASSERT(isAndLike(rule) == (rule <= FusionRule::kGeometric));
  }
}

RC_GTEST_PROP(FusionRule, PairsAreTheSumOfTheHarmonicMeansOfTheFirstOrOfAllInputs, ()) {
  const auto inputs = *densities();
  for (const bool all : {false, true}) {
    double expected = inputs.size() == 1 ? double{inputs[0]} : 0;
    for (std::size_t a = 0; a < inputs.size(); ++a) {
      for (std::size_t b = a + 1; b < inputs.size(); ++b) {
        if (a > 0 && !all) continue;
        expected += oracle::fuse(FusionRule::kHarmonic, {double{inputs[a]}, double{inputs[b]}});
      }
    }
    const float sum = meanOf(FusionRule::kPairs, inputs, false, all);
    RC_ASSERT(std::abs(double{sum} - expected) <= kMeanRounding * expected);
    if (inputs.size() < 3) RC_ASSERT(sum == meanOf(FusionRule::kHarmonic, inputs, true));
  }
}

TEST(FusionRule, OneInputIsItselfBitForBitAndTheNextMeanForgetsIt) {
  for (const FusionRule rule : allFusionRules()) {
    EXPECT_EQ(meanOf(rule, {0.3F}, false), 0.3F) << nameOf(rule);
    for (const int inputs : {1, 2, 3}) {
      FusionAccumulator accumulator(rule, inputs, 1);
      for (const float value : {9.0F, 4.0F}) {
        for (int i = 0; i < inputs; ++i) accumulator.add({value});
        EXPECT_NEAR(accumulator.mean()[0], value, 1e-5) << nameOf(rule) << " of " << inputs;
      }
    }
  }
}

/// Number of voxels: not a multiple of any vector size.
constexpr std::size_t kVoxels = 35;

/// A sum of n floats has an error of at most n roundings of 6e-8. Log and exp multiply the error by
/// the logarithm, here at most log 1e8 = 18.4: two means of up to 8 inputs stay within +-2e-5.
constexpr double kRounding = 5e-5;

/// Ray densities of one plane: [camera][group * slots + slot][voxel].
struct Densities {
  FusionInputs inputs;
  std::vector<std::vector<PlaneValues>> values;

  /// Returns one group alone.
  Densities group(int g) const {
    Densities alone{{inputs.cameras, inputs.slots_per_group, 1}, {}};
    for (const auto& camera : values) {
      alone.values.emplace_back(camera.begin() + g * inputs.slots_per_group,
                                camera.begin() + (g + 1) * inputs.slots_per_group);
    }
    return alone;
  }
  /// Returns one camera alone.
  Densities camera(int c) const {
    return {{1, inputs.slots_per_group, inputs.groups}, {values[static_cast<std::size_t>(c)]}};
  }
};

/// Draws zero in one voxel out of eight, otherwise a value from 1e-4 to 1e4.
Densities randomDensities(std::mt19937& random, const FusionInputs& inputs) {
  std::uniform_real_distribution<double> exponent(-4, 4);
  Densities densities{inputs, {}};
  for (int camera = 0; camera < inputs.cameras; ++camera) {
    auto& of_camera = densities.values.emplace_back();
    for (int slot = 0; slot < inputs.slots_per_group * inputs.groups; ++slot) {
      PlaneValues& values = of_camera.emplace_back(kVoxels);
      for (float& value : values) {
        value = random() % 8 == 0 ? 0.0F : static_cast<float>(std::pow(10.0, exponent(random)));
      }
    }
  }
  return densities;
}

void fusePlane(PlaneFusion& fusion, const Densities& densities) {
  fusion.begin();
  for (const CameraSlot& input : fusion.inputs()) {
    fusion.next() =
        densities
            .values[static_cast<std::size_t>(input.camera)][static_cast<std::size_t>(input.slot)];
    fusion.add(input);
  }
}

PlaneValues fuse(const Densities& densities, const FusionOptions& options) {
  PlaneFusion fusion(options, densities.inputs, kVoxels);
  fusePlane(fusion, densities);
  return fusion.fused();
}

/// Calls `check` with random densities for all relevant numbers of inputs, all pairs of rules and
/// both orders.
template <typename Check>
void forEachCase(std::uint32_t seed, const Check& check) {
  std::mt19937 random(seed);
  for (int cameras = 1; cameras <= 4; ++cameras) {
    for (const int slots : {1, 2, 5}) {
      for (const int groups : {1, 3}) {
        const Densities densities = randomDensities(random, {cameras, slots, groups});
        for (const auto order : {FusionOrder::kCamerasThenTime, FusionOrder::kTimeThenCameras}) {
          for (const FusionRule across_cameras : allFusionRules()) {
            for (const FusionRule across_time : allFusionRules()) {
              SCOPED_TRACE(testing::Message()
                           << cameras << " cameras " << nameOf(across_cameras) << ", " << slots
                           << " slots " << nameOf(across_time) << ", " << nameOf(order) << ", "
                           << groups << " groups");
              check(densities, FusionOptions{across_cameras, across_time, order});
            }
          }
        }
      }
    }
  }
}

TEST(PlaneFusion, IsTheOraclesSumOfGroupsUnderAllRulesAndOrders) {
  forEachCase(1, [](const Densities& densities, const FusionOptions& options) {
    const PlaneValues fused = fuse(densities, options);
    ASSERT_EQ(fused.size(), kVoxels);
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
      ASSERT_NEAR(fused[i], exact, kRounding * exact) << "voxel " << i;
    }
  });
}

TEST(PlaneFusion, CamerasThatAreKeptAreFusedAcrossTimeAloneAndChangeNothing) {
  forEachCase(3, [](const Densities& densities, const FusionOptions& options) {
    PlaneFusion fusion(options, densities.inputs, kVoxels, PlaneFusion::Keep::kCameras);
    fusePlane(fusion, densities);
    ASSERT_EQ(fusion.fused(), fuse(densities, options));
    for (int camera = 0; camera < densities.inputs.cameras; ++camera) {
      ASSERT_EQ(fusion.ofCamera(camera), fuse(densities.camera(camera), options)) << camera;
    }
  });
}

TEST(PlaneFusion, NothingIsLeftFromThePlaneBefore) {
  std::mt19937 random(4);
  forEachCase(4, [&](const Densities& first, const FusionOptions& options) {
    const Densities second = randomDensities(random, first.inputs);
    PlaneFusion fusion(options, first.inputs, kVoxels, PlaneFusion::Keep::kCameras);
    fusePlane(fusion, first);
    fusePlane(fusion, second);
    ASSERT_EQ(fusion.fused(), fuse(second, options));
    ASSERT_EQ(fusion.ofCamera(0), fuse(second.camera(0), options));
  });
}

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr VotingKernel kAll[] = {VotingKernel::kPlain,  VotingKernel::kBaseline,
                                 VotingKernel::kSse4,   VotingKernel::kAvx2,
                                 VotingKernel::kAvx512, VotingKernel::kNeon};

TEST(VotingKernel, PlainIsTheFirstOfTheAvailableOnes) {
  EXPECT_EQ(availableKernels().front(), VotingKernel::kPlain);
  EXPECT_TRUE(std::is_sorted(availableKernels().begin(), availableKernels().end()));
  EXPECT_EQ(fastestKernel(), fastestOf(availableKernels()));
}

TEST(VotingKernel, TheFastestIsNeverOneThatIsSlowerThanPlain) {
  using K = VotingKernel;
  EXPECT_EQ(fastestOf({K::kPlain}), K::kPlain);
  EXPECT_EQ(fastestOf({K::kPlain, K::kBaseline}), K::kPlain);
  EXPECT_EQ(fastestOf({K::kPlain, K::kBaseline, K::kSse4}), K::kSse4);
  EXPECT_EQ(fastestOf({K::kPlain, K::kBaseline, K::kSse4, K::kAvx2}), K::kAvx2);
  EXPECT_EQ(fastestOf({K::kPlain, K::kBaseline, K::kSse4, K::kAvx2, K::kAvx512}), K::kAvx512);
  EXPECT_EQ(fastestOf({K::kPlain, K::kBaseline, K::kNeon}), K::kNeon);
}

TEST(VotingKernel, TheSweepAcceptsEveryAvailableKernelAndRejectsTheOthersByName) {
  EXPECT_EQ(SpaceSweepOptions().kernelOrFastest(), fastestKernel());
  for (const VotingKernel kernel : kAll) {
    SpaceSweepOptions options;
    options.kernel = kernel;
    if (isAvailable(kernel)) {
      EXPECT_NO_THROW(options.validate()) << nameOf(kernel);
      EXPECT_EQ(options.kernelOrFastest(), kernel);
    } else {
      EXPECT_THAT([&] { options.validate(); },
                  ThrowsMessage<std::invalid_argument>(AllOf(
                      HasSubstr("kernel = " + std::string(nameOf(kernel))), HasSubstr("plain, "),
                      HasSubstr(std::string(nameOf(fastestKernel()))))));
    }
  }
}

}  // namespace

}  // namespace efm
