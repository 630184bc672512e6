// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/dsi/plane_fusion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "test/oracle/naive_mapper.h"

namespace efm {
namespace {

/// Full vectors of any instruction set, and a rest.
constexpr std::size_t kVoxels = 35;

/// A sum of n floats errs by at most n roundings of 6e-8, and log and exp multiply that by the
/// logarithm, here at most log 1e8 = 18.4: two means of up to 8 inputs stay within 2e-5 each way.
constexpr double kRounding = 5e-5;

/// Ray densities of one plane: [camera][group * slots + slot][voxel].
struct Densities {
  FusionInputs inputs;
  std::vector<std::vector<PlaneValues>> values;

  /// One group by itself.
  Densities group(int g) const {
    Densities alone{{inputs.cameras, inputs.slots_per_group, 1}, {}};
    for (const auto& camera : values) {
      alone.values.emplace_back(camera.begin() + g * inputs.slots_per_group,
                                camera.begin() + (g + 1) * inputs.slots_per_group);
    }
    return alone;
  }
  /// One camera by itself.
  Densities camera(int c) const {
    return {{1, inputs.slots_per_group, inputs.groups}, {values[static_cast<std::size_t>(c)]}};
  }
};

/// Zero in one voxel out of eight, else anything from 1e-4 to 1e4.
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

/// Calls with random densities of all numbers of inputs that matter, under all pairs of rules in
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

}  // namespace
}  // namespace efm
