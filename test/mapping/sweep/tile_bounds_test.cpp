// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "mapping/sweep/tile_accumulator.h"
#include "mapping/sweep/view_tiles.h"
#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/rays/chosen_rays.h"
#include "test/mapping/rays/random_rays.h"
#include "test/mapping/sweep/plain_sweep.h"

namespace efm {
namespace {

using test::RandomRays;
using test::SweepCase;
using test::SweptDsi;

/// Every size that the tiled sweep derives from bounds, driven to its bound.
class TileBoundsOn : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, TileBoundsOn, ::testing::ValuesIn(test::fastKernels()),
                         test::nameOfKernel);

DepthPlanes inversePlanes(double nearest_m, double farthest_m, int count) {
  return DepthPlanes({nearest_m, farthest_m, count, PlaneSpacing::kInverse});
}

SweepCase caseOf(const ReferenceView& view, const DepthPlanes& planes, const RayBundle& rays) {
  SweepCase input{view, planes, {}};
  input.cameras.push_back({rays});
  return input;
}

/// Where parts of a side begin, and its ends.
std::vector<double> bordersOf(int side) {
  std::vector<double> borders = {0, 1.0 * (side - 1)};
  for (const cv::Rect& tile : tilesOf({side, 1, 1, 1, 0, 0}, TileVoter::kTilePixels)) {
    for (const int cell : {tile.x - 1, tile.x}) {
      if (cell > 0) borders.push_back(cell);
    }
  }
  return borders;
}

TEST_P(TileBoundsOn, ParallaxOfHundredsOfPixelsAtHdIsThePlainKernels) {
  const ReferenceView view{1280, 720, 836, 836, 639.5, 359.5};
  const DepthPlanes planes = inversePlanes(0.3, 10, 2);
  RandomRays random(1);
  // 0.5 m aside are 1350 px between the planes; some fly 2.5 m aside and 1 m back.
  for (const Eigen::Vector3d& side :
       {Eigen::Vector3d(-0.5, 0.4, 0.05), Eigen::Vector3d(2.5, -2, -1),
        Eigen::Vector3d(0.1, 0.1, 0.299)}) {
    RayBundle rays;
    for (int packet = 0; packet < 60; ++packet) {
      const double part = packet / 59.0;
      test::appendPacket({part * side, true, planes.depth(packet % 2)}, view,
                         random.points(view, 150), rays);
    }
    SCOPED_TRACE(testing::Message() << "to " << side.transpose());
    test::expectThePlainSweep(caseOf(view, planes, rays), GetParam());
  }
}

TEST_P(TileBoundsOn, MarginsUpToAndBeyondTheRoomForCompactRaysAreThePlainKernels) {
  const ReferenceView view{200, 150, 150, 150, 100, 75};
  const DepthPlanes planes = inversePlanes(0.5, 5, 12);
  RandomRays random(2);
  // From the middle a ray moves by 150 C_x (2 - 0.2) / 2 px to the outermost planes: 2048 with
  // C_x = 15.17.
  for (const Eigen::Vector3d& center :
       {Eigen::Vector3d(15.1, 0, 0), Eigen::Vector3d(15.16, 0, 0), Eigen::Vector3d(15.17, 0, 0),
        Eigen::Vector3d(15.18, 0, 0), Eigen::Vector3d(-15.18, 0, 0), Eigen::Vector3d(0, 15.1, 0),
        Eigen::Vector3d(0, -15.2, 0), Eigen::Vector3d(0, 0, 0.475), Eigen::Vector3d(0, 0, 0.49),
        Eigen::Vector3d(300, 0, 0), Eigen::Vector3d(15, 15, -1)}) {
    RayBundle rays;
    for (int plane = 0; plane < 12; ++plane) {
      test::appendPacket({center, true, planes.depth(plane)}, view, random.points(view, 300), rays);
    }
    SCOPED_TRACE(testing::Message() << "from " << center.transpose());
    test::expectThePlainSweep(caseOf(view, planes, rays), GetParam());
  }
}

TEST_P(TileBoundsOn, RaysOnEveryBorderOfTilesAndTheViewAreCountedOnce) {
  const ReferenceView view{150, 130, 100, 100, 75, 65};
  const DepthPlanes planes = inversePlanes(0.5, 5, 3);
  std::vector<Eigen::Vector2d> inside;
  std::vector<Eigen::Vector2d> all;
  for (const double border_x : bordersOf(150)) {
    for (const double border_y : bordersOf(130)) {
      for (const double off_x : {-1e-3, 0.0, 1e-3}) {
        for (const double off_y : {-1e-3, 0.0, 1e-3}) {
          const Eigen::Vector2d point(border_x + off_x, border_y + off_y);
          all.push_back(point);
          if (point.minCoeff() >= 0 && point.x() < 149 && point.y() < 129) inside.push_back(point);
        }
      }
    }
  }
  const SweptDsi fast = sweep(caseOf(view, planes, test::raysFromOrigin(all)), GetParam());
  EXPECT_EQ(fast.result.votes[0].cast, 3 * inside.size());
  EXPECT_EQ(fast.result.votes[0].total(), 3 * all.size());
  // Each of the rays alone is one vote, or none.
  for (const Eigen::Vector2d& point : all) {
    const SweptDsi one = sweep(caseOf(view, planes, test::raysFromOrigin({point})), GetParam());
    double mass = 0;
    for (const float value : one.dsi) mass += double{value};
    ASSERT_NEAR(mass, static_cast<double>(one.result.votes[0].cast), 1e-5) << point.transpose();
  }
}

TEST_P(TileBoundsOn, RaysThatCrossBordersOfTilesFromPlaneToPlaneAreNeverLost) {
  // As many steps across each border of two tiles as there are fractions of a pixel.
  const ReferenceView view{100, 100, 80, 80, 50, 50};
  const DepthPlanes planes = inversePlanes(0.5, 5, 400);
  for (const Eigen::Vector3d& center : {Eigen::Vector3d(0.01, 0.02, 0), Eigen::Vector3d(0, 0, -0.4),
                                        Eigen::Vector3d(-0.3, 0.01, 0.1)}) {
    RayBundle rays;
    std::vector<Eigen::Vector2d> points;
    for (int i = 0; i < 40; ++i) points.emplace_back(47.3 + 0.11 * i, 52.1 - 0.13 * i);
    test::appendPacket({center, true, planes.depth(200)}, view, points, rays);
    test::expectThePlainSweep(caseOf(view, planes, rays), GetParam());
  }
}

TEST_P(TileBoundsOn, WideAndHighViewsAreThePlainKernels) {
  // Coordinates count from multiples of 1024 px: of no, one, some and many tiles.
  for (const cv::Size& size : {cv::Size(1023, 8), cv::Size(1026, 9), cv::Size(2050, 7),
                               cv::Size(4100, 6), cv::Size(10'000, 8), cv::Size(5, 9000)}) {
    const ReferenceView view{size.width, size.height,      700,
                             700,        0.5 * size.width, 0.5 * size.height};
    const DepthPlanes planes = inversePlanes(0.5, 5, 4);
    RandomRays random(3);
    RayBundle rays;
    for (const Eigen::Vector3d& center :
         {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.05, 0.003, 0), Eigen::Vector3d(0, 0, 0.1),
          Eigen::Vector3d(3, 0, -0.1), Eigen::Vector3d(-8, 0.01, 0)}) {
      for (int plane = 0; plane < 4; ++plane) {
        test::appendPacket({center, true, planes.depth(plane)}, view, random.points(view, 1000),
                           rays);
      }
    }
    SCOPED_TRACE(testing::Message() << size.width << " x " << size.height);
    test::expectThePlainSweep(caseOf(view, planes, rays), GetParam());
  }
}

TEST_P(TileBoundsOn, VotesWhereTheOriginOfCoordinatesChangesAreCountedOnce) {
  // Of the last two tiles across, one counts coordinates from 0 and one from 1024: their cells meet
  // at pixel 1038. Every ray stays in the view.
  const ReferenceView view{1100, 3, 500, 500, 550, 1};
  ASSERT_EQ(tilesOf(view, TileVoter::kTilePixels).back().x, 1038);
  const DepthPlanes planes = inversePlanes(0.5, 5, 50);
  RandomRays random(5);
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < 2000; ++i) points.emplace_back(random.uniform(1037.9, 1038.1), 1.3);
  RayBundle rays;
  test::appendPacket({{1e-4, 0, 0}, true, planes.depth(25)}, view, points, rays);
  const SweptDsi swept = sweep(caseOf(view, planes, rays), GetParam());
  EXPECT_EQ(swept.result.votes[0].cast, 2000U * 50U);
  const test::ExactVotes exact = test::voteExactly(rays, view, planes);
  EXPECT_LE(std::abs(test::differenceOf(swept.dsi, exact.dsi).signed_error), 1e-5);
}

}  // namespace
}  // namespace efm
