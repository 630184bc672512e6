// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <vector>

#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/rays/chosen_rays.h"
#include "test/mapping/rays/random_rays.h"
#include "test/mapping/sweep/plain_sweep.h"

namespace efm {
namespace {

using test::RandomRays;
using test::SweepCase;
using test::SweptDsi;

/// Few and many planes, packets and rays.
class SweepShapesOn : public ::testing::TestWithParam<VotingKernel> {
 protected:
  static constexpr ReferenceView kView{150, 100, 90, 95, 70, 52};

  SweepCase caseOf(const DepthPlanes& planes, const RayBundle& rays) const {
    SweepCase input{kView, planes, {}};
    input.cameras.push_back({rays});
    return input;
  }
  /// Rays of packets that walk along a line.
  RayBundle walk(const DepthPlanes& planes, const Eigen::Vector3d& step, int packets, int rays) {
    RayBundle bundle;
    for (int packet = 0; packet < packets; ++packet) {
      const double depth_m = planes.depth(packet % planes.size());
      test::appendPacket({packet * step, true, depth_m}, kView, random_.points(kView, rays),
                         bundle);
    }
    return bundle;
  }

  RandomRays random_{4};
};

INSTANTIATE_TEST_SUITE_P(Kernels, SweepShapesOn, ::testing::ValuesIn(test::fastKernels()),
                         test::nameOfKernel);

TEST_P(SweepShapesOn, OnePlaneIsThePlainKernels) {
  const DepthPlanes planes({0.5, 5, 1, PlaneSpacing::kInverse});
  test::expectThePlainSweep(caseOf(planes, walk(planes, {0.01, 0.002, 0.003}, 30, 200)),
                            GetParam());
}

TEST_P(SweepShapesOn, FiveHundredPlanesAreThePlainKernels) {
  const DepthPlanes planes({0.5, 5, 500, PlaneSpacing::kInverse});
  test::expectThePlainSweep(caseOf(planes, walk(planes, {0.01, 0.002, 0.003}, 10, 60)), GetParam());
}

TEST_P(SweepShapesOn, PlanesAtEqualDistancesAreThePlainKernels) {
  for (const int count : {2, 3, 40}) {
    const DepthPlanes planes({0.3, 30, count, PlaneSpacing::kLinear});
    test::expectThePlainSweep(caseOf(planes, walk(planes, {0.01, 0.002, 0.003}, 40, 50)),
                              GetParam());
  }
}

TEST_P(SweepShapesOn, PlanesThatAreAllOneGroupOrEachItsOwnAreThePlainKernels) {
  // A ray moves by less than 1 px between all planes, and by 200 px from each to the next.
  for (const double aside_m : {1e-4, 0.01, 12.0}) {
    const DepthPlanes planes({0.5, 5, 10, PlaneSpacing::kInverse});
    RayBundle rays;
    for (int plane = 0; plane < 10; ++plane) {
      test::appendPacket({{aside_m, 0, 0}, true, planes.depth(plane)}, kView,
                         random_.points(kView, 300), rays);
    }
    SCOPED_TRACE(testing::Message() << aside_m << " m aside");
    test::expectThePlainSweep(caseOf(planes, rays), GetParam());
  }
}

TEST_P(SweepShapesOn, NearlyEqualPlanesAreThePlainKernels) {
  const DepthPlanes planes({1, 1 + 1e-9, 20, PlaneSpacing::kInverse});
  test::expectThePlainSweep(caseOf(planes, walk(planes, {0.01, 0.002, 0.003}, 30, 100)),
                            GetParam());
}

TEST_P(SweepShapesOn, AHundredThousandPacketsOfOneRayAreThePlainKernels) {
  const DepthPlanes planes({0.5, 5, 3, PlaneSpacing::kInverse});
  test::expectThePlainSweep(caseOf(planes, walk(planes, {2e-6, 1e-6, -1e-6}, 100'000, 1)),
                            GetParam());
}

TEST_P(SweepShapesOn, ALongWalkIsThePlainKernels) {
  // Enough rays that they are sorted by stretches of motion, each with bins of its own.
  const DepthPlanes planes({0.5, 5, 4, PlaneSpacing::kInverse});
  test::expectThePlainSweep(caseOf(planes, walk(planes, {0.02, -0.01, 0.001}, 300, 60)),
                            GetParam());
}

TEST_P(SweepShapesOn, EmptyPacketsChangeNothing) {
  const DepthPlanes planes({0.5, 5, 4, PlaneSpacing::kInverse});
  const RayBundle rays = walk(planes, {0.01, 0, 0}, 5, 100);
  RayBundle with_empty = rays;
  with_empty.packets.clear();
  for (const RayPacket& packet : rays.packets) {
    with_empty.packets.push_back({packet.begin, packet.begin, {9, 9, 9}, true});
    with_empty.packets.push_back(packet);
    with_empty.packets.push_back({packet.end, packet.end, {0, 0, 2}, false});
  }
  const SweptDsi a = sweep(caseOf(planes, rays), GetParam());
  const SweptDsi b = sweep(caseOf(planes, with_empty), GetParam());
  EXPECT_EQ(a.result.votes[0].cast, b.result.votes[0].cast);
  EXPECT_LE(test::differenceOf(b.dsi, a.dsi).error, test::kFastErrorOverMass);
}

TEST_P(SweepShapesOn, EmptyBundlesLeaveTheDsiEmpty) {
  const DepthPlanes planes({0.5, 5, 4, PlaneSpacing::kInverse});
  RayBundle empty_packet;
  empty_packet.packets.push_back({});
  for (const RayBundle& nothing : {RayBundle(), empty_packet}) {
    const SweptDsi swept = sweep(caseOf(planes, nothing), GetParam());
    EXPECT_EQ(swept.dsi, std::vector<float>(4 * kView.pixels(), 0.0F));
    EXPECT_EQ(swept.result.votes[0].total(), 0U);
  }
}

TEST_P(SweepShapesOn, RaysThatAreAllOutsideAreCountedAndVoteNowhere) {
  const DepthPlanes planes({0.5, 5, 4, PlaneSpacing::kInverse});
  for (const Eigen::Vector2d& point :
       {Eigen::Vector2d(-1, 50), Eigen::Vector2d(150, 50), Eigen::Vector2d(70, -0.01),
        Eigen::Vector2d(70, 99), Eigen::Vector2d(149, 50), Eigen::Vector2d(1e9, -1e9)}) {
    const std::vector<Eigen::Vector2d> points(1000, point);
    const SweptDsi swept = sweep(caseOf(planes, test::raysFromOrigin(points)), GetParam());
    EXPECT_EQ(swept.dsi, std::vector<float>(4 * kView.pixels(), 0.0F)) << point.transpose();
    EXPECT_EQ(swept.result.votes[0].outside_view, 4000U) << point.transpose();
    EXPECT_EQ(swept.result.votes[0].cast, 0U) << point.transpose();
  }
}

TEST_P(SweepShapesOn, ThousandsOfRaysInOneVoxelAreAllCountedAndKeepTheirPlace) {
  const DepthPlanes planes({0.5, 5, 2, PlaneSpacing::kInverse});
  // A vote is rounded to 1/4096 px twice; the rays are equal, so that all are off alike.
  constexpr double kOff = 2.0 / 4096 + 1.0 / 32'768;
  for (const Eigen::Vector2d& point :
       {Eigen::Vector2d(20, 20), Eigen::Vector2d(49.5, 33.5), Eigen::Vector2d(0, 0),
        Eigen::Vector2d(148.999, 98.999), Eigen::Vector2d(50 - 1.0 / 4096, 33 + 4095.0 / 4096)}) {
    const std::vector<Eigen::Vector2d> points(10'000, point);
    const SweepCase input = caseOf(planes, test::raysFromOrigin(points));
    const test::ExactVotes exact = test::voteExactly(input.cameras[0][0], kView, planes);
    const SweptDsi fast = sweep(input, GetParam());
    EXPECT_EQ(fast.result.votes[0].cast, 20'000U) << point.transpose();
    for (std::size_t i = 0; i < exact.dsi.size(); ++i) {
      ASSERT_NEAR(double{fast.dsi[i]}, exact.dsi[i], kOff * 10'000) << point.transpose();
    }
  }
}

}  // namespace
}  // namespace efm
