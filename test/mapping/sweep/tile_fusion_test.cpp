// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/tiles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/sweep/sweep_case.h"

namespace efm {
namespace {

/// Tiles that fill vectors or leave a rest, in the middle and on each border of the view.
const std::vector<cv::Rect> kTiles = {{0, 0, 63, 63},   {50, 43, 50, 43}, {87, 67, 63, 63},
                                      {20, 30, 1, 1},   {149, 0, 1, 63},  {60, 129, 17, 1},
                                      {30, 40, 16, 20}, {31, 41, 33, 3},  {0, 100, 48, 30}};

/// Rays in and around a tile, in clusters, so that most cells are empty where there are few.
TileRays clusteredRays(std::mt19937& random, const TileCells& cells, std::size_t count) {
  const cv::Rect& tile = cells.tile;
  std::uniform_real_distribution<double> across(-3, tile.width + 3);
  std::uniform_real_distribution<double> along(-3, tile.height + 3);
  std::uniform_real_distribution<double> around(0, 2);
  std::vector<Eigen::Vector2d> points;
  Eigen::Vector2d center(0, 0);
  for (std::size_t i = 0; i < count; ++i) {
    if (i % 8 == 0) center = {tile.x + across(random), tile.y + along(random)};
    points.emplace_back(center.x() + around(random), center.y() + around(random));
  }
  return test::raysAt(points, cells.origin);
}

/// From none to so many that cells fill up.
const std::vector<std::size_t> kCounts = {0, 1, 9, 60, 400, 3000, 90'000};

class TileFusionOn : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, TileFusionOn, ::testing::ValuesIn(test::fastKernels()),
                         test::nameOfKernel);

/// The inputs of a tile on two planes, fused by `PlaneFusion` alone.
PlaneValues fusePlainly(VotingKernel kernel, const TileCells& cells, std::vector<TileRays>& rays,
                        const FusionOptions& options, const FusionInputs& inputs,
                        std::vector<std::uint64_t>& units) {
  TileAccumulator accumulator(kernel);
  accumulator.moveTo(cells);
  PlaneFusion fusion(options, inputs, static_cast<std::size_t>(cells.tile.area()));
  fusion.begin();
  for (const CameraSlot& input : fusion.inputs()) {
    const auto slots = static_cast<std::size_t>(inputs.slots_per_group * inputs.groups);
    const auto camera = static_cast<std::size_t>(input.camera);
    accumulator.vote(rays[camera * slots + static_cast<std::size_t>(input.slot)], 0);
    units[camera] += accumulator.resolve(fusion.next().data());
    fusion.add(input);
  }
  return fusion.fused();
}

TEST_P(TileFusionOn, HasTheBitsOfPlaneFusionAlsoWherePairsAreResolvedAndFusedAtOnce) {
  std::mt19937 random(3);
  for (const FusionRule rule : allFusionRules()) {
    for (const FusionOrder order : {FusionOrder::kCamerasThenTime, FusionOrder::kTimeThenCameras}) {
      for (const FusionInputs inputs : {FusionInputs{2, 1, 1}, {2, 1, 3}, {2, 2, 1}, {3, 1, 2}}) {
        const FusionOptions options{rule, FusionRule::kArithmetic, order};
        TileFusion fusion(options, inputs, PlaneFusion::Keep::kFusedOnly, GetParam());
        TileFusion keeping(options, inputs, PlaneFusion::Keep::kCameras, GetParam());
        std::vector<std::uint64_t> units(static_cast<std::size_t>(inputs.cameras));
        for (const cv::Rect& tile : kTiles) {
          SCOPED_TRACE(testing::Message() << tile << ", " << nameOf(rule) << ", " << inputs.cameras
                                          << " cameras, " << inputs.groups << " groups");
          const TileCells cells(tile, test::kTiledView);
          fusion.moveTo(cells);
          keeping.moveTo(cells);
          std::vector<TileRays> rays;
          for (int i = 0; i < inputs.cameras * inputs.slots_per_group * inputs.groups; ++i) {
            rays.push_back(clusteredRays(random, cells, kCounts[random() % 7]));
          }
          for (int plane = 0; plane < 2; ++plane) {
            const PlaneValues expected =
                fusePlainly(GetParam(), cells, rays, options, inputs, units);
            ASSERT_EQ(fusion.fuse(rays, 0), expected);
            ASSERT_EQ(keeping.fuse(rays, 0), expected);
            ASSERT_EQ(fusion.units(), units);
            ASSERT_EQ(keeping.units(), units);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace efm
