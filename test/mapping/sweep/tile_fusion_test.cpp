// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/tile_fusion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/sweep/rays_at.h"

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

TEST_P(TileFusionOn, SparseVotesHaveTheSameBitsAndCountsWhereFoundAndAreZeroElsewhere) {
  std::mt19937 random(1);
  TileAccumulator accumulator(GetParam());
  int sparse = 0;
  for (const cv::Rect& tile : kTiles) {
    const TileCells cells(tile, test::kTiledView);
    accumulator.moveTo(cells);
    for (const std::size_t count : kCounts) {
      SCOPED_TRACE(testing::Message() << tile << ", " << count << " rays");
      TileRays rays = clusteredRays(random, cells, count);
      PlaneValues all(static_cast<std::size_t>(tile.area()), -1.0F);
      PlaneValues some = all;
      accumulator.vote(rays, 0);
      const std::uint64_t votes = accumulator.resolve(all.data());
      accumulator.vote(rays, 0);
      if (!accumulator.isSparse()) {
        ASSERT_EQ(accumulator.resolve(some.data()), votes);
        ASSERT_EQ(some, all);
        continue;
      }
      ++sparse;
      ASSERT_EQ(accumulator.findOccupied(), votes);
      const kernels::TilePixels found = accumulator.occupied();
      accumulator.resolveBlocks(accumulator.blocksOf(found), some.data());
      for (int y = 0; y < tile.height; ++y) {
        for (int x = 0; x < tile.width; ++x) {
          const auto i = static_cast<std::size_t>(y * tile.width + x);
          const bool is_found = (found.rows[y] >> x & 1) != 0;
          ASSERT_EQ(is_found ? some[i] : 0.0F, all[i]) << x << ", " << y;
        }
      }
      // No vote is left, also where no block is resolved.
      accumulator.vote(rays, 0);
      accumulator.findOccupied();
      kernels::TilePixels none = found;
      std::fill(std::begin(none.rows), std::end(none.rows), 0);
      const PlaneValues before = some;
      accumulator.resolveBlocks(accumulator.blocksOf(none), some.data());
      ASSERT_EQ(some, before);
      TileRays no_rays = clusteredRays(random, cells, 0);
      accumulator.vote(no_rays, 0);
      ASSERT_EQ(accumulator.resolve(some.data()), 0U);
      ASSERT_EQ(some, PlaneValues(some.size(), 0.0F));
    }
  }
  EXPECT_GT(sparse, 10);
}

/// The inputs of a tile on two planes, fused by `PlaneFusion` alone.
PlaneValues fusePlainly(VotingKernel kernel, const TileCells& cells, std::vector<TileRays>& rays,
                        const FusionOptions& options, const FusionInputs& inputs,
                        std::vector<std::uint64_t>& votes) {
  TileAccumulator accumulator(kernel);
  accumulator.moveTo(cells);
  PlaneFusion fusion(options, inputs, static_cast<std::size_t>(cells.tile.area()));
  fusion.begin();
  for (const CameraSlot& input : fusion.inputs()) {
    const auto slots = static_cast<std::size_t>(inputs.slots_per_group * inputs.groups);
    const auto camera = static_cast<std::size_t>(input.camera);
    accumulator.vote(rays[camera * slots + static_cast<std::size_t>(input.slot)], 0);
    votes[camera] += accumulator.resolve(fusion.next().data());
    fusion.add(input);
  }
  return fusion.fused();
}

TEST_P(TileFusionOn, HasTheBitsOfPlaneFusionAlsoWherePairsAreFusedOnlyWhereBothHaveVotes) {
  std::mt19937 random(3);
  for (const FusionRule rule : allFusionRules()) {
    for (const FusionOrder order : {FusionOrder::kCamerasThenTime, FusionOrder::kTimeThenCameras}) {
      for (const FusionInputs inputs : {FusionInputs{2, 1, 1}, {2, 1, 3}, {2, 2, 1}, {3, 1, 2}}) {
        const FusionOptions options{rule, FusionRule::kArithmetic, order};
        TileFusion fusion(options, inputs, PlaneFusion::Keep::kFusedOnly, GetParam());
        TileFusion keeping(options, inputs, PlaneFusion::Keep::kCameras, GetParam());
        std::vector<std::uint64_t> votes(static_cast<std::size_t>(inputs.cameras));
        for (const cv::Rect& tile : kTiles) {
          SCOPED_TRACE(testing::Message() << tile << ", " << nameOf(rule) << ", " << inputs.cameras
                                          << " cameras, " << inputs.groups << " groups");
          const TileCells cells(tile, test::kTiledView);
          fusion.moveTo(cells);
          keeping.moveTo(cells);
          std::vector<TileRays> rays;
          for (int i = 0; i < inputs.cameras * inputs.slots_per_group * inputs.groups; ++i) {
            rays.push_back(clusteredRays(random, cells, kCounts[random() % 6]));
          }
          for (int plane = 0; plane < 2; ++plane) {
            const PlaneValues expected =
                fusePlainly(GetParam(), cells, rays, options, inputs, votes);
            ASSERT_EQ(fusion.fuse(rays, 0), expected);
            ASSERT_EQ(keeping.fuse(rays, 0), expected);
            ASSERT_EQ(fusion.votes(), votes);
            ASSERT_EQ(keeping.votes(), votes);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace efm
