// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/rays/chosen_rays.h"
#include "test/mapping/rays/random_rays.h"
#include "test/mapping/sweep/plain_sweep.h"

namespace efm {
namespace {

using test::RandomRays;
using test::SweepCase;

/// Cameras anywhere: before, between, on and behind the planes, looking either way.
class CameraPlacesOn : public ::testing::TestWithParam<VotingKernel> {
 protected:
  /// Rays of cameras at the centres that fill the view on one plane each: all planes in turn.
  SweepCase caseOf(const std::vector<Eigen::Vector3d>& centers, bool forward,
                   const DepthPlanes& planes) {
    SweepCase input{kView, planes, {}};
    RayBundle bundle;
    for (const Eigen::Vector3d& center_ref : centers) {
      for (int plane = 0; plane < planes.size(); ++plane) {
        const double depth_m = planes.depth(plane);
        if (forward ? center_ref.z() >= depth_m : center_ref.z() <= depth_m) continue;
        test::appendPacket({center_ref, forward, depth_m}, kView, random_.points(kView, 300),
                           bundle);
      }
    }
    input.cameras.push_back({bundle});
    return input;
  }

  static constexpr ReferenceView kView{150, 100, 90, 95, 70, 52};
  RandomRays random_{1};
};

INSTANTIATE_TEST_SUITE_P(Kernels, CameraPlacesOn, ::testing::ValuesIn(test::fastKernels()),
                         test::nameOfKernel);

const std::vector<DepthPlanes>& manyPlanes() {
  static const std::vector<DepthPlanes> kPlanes = {
      DepthPlanes({0.5, 4.0, 9, PlaneSpacing::kInverse}),
      DepthPlanes({0.5, 4.0, 9, PlaneSpacing::kLinear}),
      DepthPlanes({0.5, 4.0, 2, PlaneSpacing::kInverse}),
      DepthPlanes({0.5, 4.0, 1, PlaneSpacing::kInverse})};
  return kPlanes;
}

TEST_P(CameraPlacesOn, BeforeAllPlanesAreThePlainKernels) {
  for (const DepthPlanes& planes : manyPlanes()) {
    for (const double z : {0.0, 0.2, -0.3, -20.0}) {
      test::expectThePlainSweep(caseOf({{0.1, -0.05, z}}, true, planes), GetParam());
    }
  }
}

TEST_P(CameraPlacesOn, JustBeforeAPlaneAreThePlainKernels) {
  for (const DepthPlanes& planes : manyPlanes()) {
    for (int plane = 0; plane < planes.size(); ++plane) {
      for (const double before_m : {1e-2, 1e-4}) {
        const double z = planes.depth(plane) - before_m;
        SCOPED_TRACE(testing::Message() << before_m << " m before plane " << plane);
        test::expectThePlainSweep(caseOf({{0.1, -0.05, z}}, true, planes), GetParam());
      }
    }
  }
}

TEST_P(CameraPlacesOn, BetweenPlanesAreThePlainKernelsInBothDirections) {
  for (const DepthPlanes& planes : manyPlanes()) {
    for (const double z : {0.6, 1.1, 3.7}) {
      for (const bool forward : {true, false}) {
        SCOPED_TRACE(testing::Message() << "at " << z << (forward ? " forward" : " backward"));
        test::expectThePlainSweep(caseOf({{0.1, -0.05, z}}, forward, planes), GetParam());
      }
    }
  }
}

TEST_P(CameraPlacesOn, BehindAllPlanesLookingBackAreThePlainKernels) {
  for (const DepthPlanes& planes : manyPlanes()) {
    for (const double z : {4.5, 9.0}) {
      test::expectThePlainSweep(caseOf({{0.1, -0.05, z}}, false, planes), GetParam());
    }
  }
}

TEST_P(CameraPlacesOn, BackwardRaysFromJustBehindTheFarthestPlaneAreThePlainKernels) {
  for (const DepthPlanes& planes : manyPlanes()) {
    for (const double behind_m : {1e-2, 1e-3, 1e-4}) {
      const double z = planes.depth(planes.size() - 1) + behind_m;
      SCOPED_TRACE(testing::Message() << behind_m << " m behind, " << planes.size() << " planes");
      test::expectThePlainSweep(caseOf({{0.5, -0.2, z}}, false, planes), GetParam());
    }
  }
}

TEST_P(CameraPlacesOn, OnAPlaneAreBehindItAsInThePlainKernel) {
  // Depths whose inverse is rounded, so that a centre's depth times it is not 1.
  for (const double farthest : {4.0, 49.0, 4.9, 9.8}) {
    for (const int count : {1, 2, 9}) {
      const DepthPlanes planes({0.49, farthest, count, PlaneSpacing::kLinear});
      for (int plane = 0; plane < count; ++plane) {
        for (const bool forward : {true, false}) {
          SCOPED_TRACE(testing::Message() << "on plane " << plane << " of " << count << " to "
                                          << farthest << (forward ? " forward" : " backward"));
          const double z = planes.depth(plane);
          // The pixel that all rays would meet is inside the view.
          SweepCase input = caseOf({{0.01, 0.02, z}}, forward, planes);
          RayBundle& bundle = input.cameras.front().front();
          test::appendPacket({{0.01, 0.02, z}, forward, 0.3}, kView, random_.points(kView, 100),
                             bundle);
          test::expectThePlainSweep(input, GetParam());
        }
      }
    }
  }
}

TEST_P(CameraPlacesOn, AllOfThemInOneBundleAreThePlainKernels) {
  const std::vector<Eigen::Vector3d> centers = {{0, 0, 0},       {0.1, 0, 0.3},  {-0.2, 0.1, 1.1},
                                                {0.3, -0.3, -2}, {0.1, 0.1, 3},  {0, 0.2, 0.499},
                                                {0, 0, 1e-7},    {-3, 2, -0.25}, {40, 0, 0}};
  for (const DepthPlanes& planes : manyPlanes()) {
    SweepCase input = caseOf(centers, true, planes);
    input.cameras.push_back(caseOf(centers, false, planes).cameras.front());
    test::expectThePlainSweep(input, GetParam());
  }
}

TEST_P(CameraPlacesOn, RaysThatAreParallelToThePlanesVoteNowhereAndAreOutside) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const std::vector<float> values = {kNan,   -kNan, kInfinity, -kInfinity, 1e30F, -1e30F, 3e38F,
                                     -3e38F, 1e20F, 1e10F,     -1e10F,     1e7F,  -1e7F,  70.5F};
  for (const DepthPlanes& planes : manyPlanes()) {
    for (const double z : {0.0, 0.2, -0.3, 1.1, 0.4999}) {
      SweepCase input{kView, planes, {}};
      RayBundle bundle;
      for (const float x : values) {
        for (const float y : values) {
          bundle.x_inf.push_back(x);
          bundle.y_inf.push_back(y);
        }
      }
      bundle.packets.push_back({0, bundle.size(), {0.1, 0.05, z}, true});
      input.cameras.push_back({bundle});
      SCOPED_TRACE(testing::Message() << "from " << z << ", " << planes.size() << " planes");
      test::expectThePlainSweep(input, GetParam());
    }
  }
}

}  // namespace
}  // namespace efm
