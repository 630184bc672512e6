// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/tile_votes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <vector>

#include "mapping/dsi/plane_fusion.h"
#include "mapping/sweep/tile_accumulator.h"
#include "test/mapping/kernels/fast_kernels.h"

namespace efm {
namespace {

constexpr float kUnit = 1 << kernels::kFractionBits;
const ReferenceView kView{150, 130, 100, 100, 75, 65};

/// Tiles that fill vectors or leave a rest, in the middle and on each border of the view.
const std::vector<cv::Rect> kTiles = {{0, 0, 63, 63},   {50, 43, 50, 43}, {87, 67, 63, 63},
                                      {20, 30, 1, 1},   {149, 0, 1, 63},  {60, 129, 17, 1},
                                      {30, 40, 16, 20}, {31, 41, 33, 3},  {0, 100, 48, 30}};

/// Rays in and around a tile, in clusters, so that most cells are empty where there are few.
TileRays clusteredRays(std::mt19937& random, const cv::Rect& tile, const TileVoter& voter,
                       std::size_t count) {
  TileRays rays;
  rays.reserve(count);
  std::uniform_real_distribution<float> across(-3, static_cast<float>(tile.width) + 3);
  std::uniform_real_distribution<float> along(-3, static_cast<float>(tile.height) + 3);
  std::uniform_real_distribution<float> around(0, 2);
  cv::Point2f center;
  for (std::size_t i = 0; i < count; ++i) {
    if (i % 8 == 0) center = {across(random), along(random)};
    const auto place = [&](int corner, int origin, float in_tile) {
      return (static_cast<float>(corner - origin) + in_tile + around(random)) * kUnit;
    };
    rays.view().x[i] = place(tile.x, voter.origin().x, center.x);
    rays.view().y[i] = place(tile.y, voter.origin().y, center.y);
    rays.view().dx[i] = rays.view().dy[i] = 0;
  }
  rays.resize(count);
  rays.pad();
  return rays;
}

/// From none to so many that cells fill up.
const std::vector<std::size_t> kCounts = {0, 1, 9, 60, 400, 3000, 90'000};

PlaneValues noValues(const cv::Rect& tile) {
  return PlaneValues(static_cast<std::size_t>(tile.area()), -1.0F);
}

bool sameBits(const PlaneValues& a, const PlaneValues& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

class TileVotesOn : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, TileVotesOn, ::testing::ValuesIn(test::fastKernels()),
                         test::nameOfKernel);

TEST_P(TileVotesOn, WhatWaitsHasTheSameBitsAndCountsWhereFoundAndIsZeroElsewhere) {
  std::mt19937 random(1);
  TileVoter voter(GetParam());
  bool some_waited = false;
  bool some_did_not = false;
  for (const cv::Rect& tile : kTiles) {
    voter.moveTo(tile, kView);
    for (const std::size_t count : kCounts) {
      TileRays rays = clusteredRays(random, tile, voter, count);
      PlaneValues all = noValues(tile);
      const std::uint64_t votes = voter.vote(rays, 0, all.data());
      PlaneValues some = noValues(tile);
      TileDensity density{some.data(), true};
      ASSERT_EQ(voter.vote(rays, 0, density), votes) << tile << ", " << count << " rays";
      if (density.waiting == nullptr) {
        some_did_not = true;
        ASSERT_TRUE(sameBits(some, all)) << tile << ", " << count << " rays";
        continue;
      }
      some_waited = true;
      const kernels::TilePixels found = density.waiting->found();
      density.waiting->foldSome(density.waiting->blocksOf(found), some.data());
      for (int y = 0; y < tile.height; ++y) {
        for (int x = 0; x < tile.width; ++x) {
          const auto i = static_cast<std::size_t>(y * tile.width + x);
          const bool is_found = (found.rows[y] >> x & 1) != 0;
          ASSERT_EQ(is_found ? some[i] : 0.0F, all[i])
              << tile << ", " << count << " rays, at " << x << ", " << y;
        }
      }
    }
  }
  EXPECT_TRUE(some_waited);
  EXPECT_TRUE(some_did_not);
}

TEST_P(TileVotesOn, NothingIsLeftOfVotesThatWaited) {
  std::mt19937 random(2);
  TileVoter voter(GetParam());
  for (const cv::Rect& tile : kTiles) {
    voter.moveTo(tile, kView);
    TileRays rays = clusteredRays(random, tile, voter, static_cast<std::size_t>(tile.area()) / 4);
    PlaneValues values = noValues(tile);
    TileDensity density{values.data(), true};
    voter.vote(rays, 0, density);
    ASSERT_NE(density.waiting, nullptr);
    kernels::TilePixels none = density.waiting->found();
    std::fill(std::begin(none.rows), std::end(none.rows), 0);
    density.waiting->foldSome(density.waiting->blocksOf(none), values.data());
    EXPECT_TRUE(sameBits(values, noValues(tile))) << "nothing was asked for";
    TileRays no_rays = clusteredRays(random, tile, voter, 0);
    EXPECT_EQ(voter.vote(no_rays, 0, values.data()), 0U);
    for (const float value : values) ASSERT_EQ(value, 0.0F) << tile;
  }
}

/// Several planes of a tile fused from rays[camera][group], with votes waiting or not.
class PairsOnATile {
 public:
  PairsOnATile(VotingKernel kernel, const cv::Rect& tile, const FusionOptions& options)
      : voter_(kernel), tile_(tile), options_(options), kernel_(kernel) {
    voter_.moveTo(tile, kView);
  }

  void expectSameBits(std::vector<std::vector<TileRays>> rays) {
    const FusionInputs inputs{2, 1, static_cast<int>(rays[0].size())};
    const auto voxels = static_cast<std::size_t>(tile_.area());
    PlaneFusion whole(options_, inputs, voxels, PlaneFusion::Keep::kFusedOnly, kernel_);
    PlaneFusion sparse(options_, inputs, voxels, PlaneFusion::Keep::kFusedOnly, kernel_);
    std::vector<std::uint64_t> votes_of_whole(2);
    std::vector<std::uint64_t> votes_of_sparse(2);
    const auto rays_of = [&](int camera, int slot) -> TileRays& {
      return rays[static_cast<std::size_t>(camera)][static_cast<std::size_t>(slot)];
    };
    for (int plane = 0; plane < 2; ++plane) {
      const PlaneValues& a = whole.fuse([&](int camera, int slot, PlaneValues& values) {
        votes_of_whole[static_cast<std::size_t>(camera)] +=
            voter_.vote(rays_of(camera, slot), 0, values.data());
      });
      const PlaneValues& b = sparse.fuse([&](int camera, int slot, TileDensity& density) {
        votes_of_sparse[static_cast<std::size_t>(camera)] +=
            voter_.vote(rays_of(camera, slot), 0, density);
      });
      ASSERT_TRUE(sameBits(a, b)) << tile_ << ", " << nameOf(options_.across_cameras);
      ASSERT_EQ(votes_of_whole, votes_of_sparse);
    }
  }

  TileRays rays(std::mt19937& random, std::size_t count) const {
    return clusteredRays(random, tile_, voter_, count);
  }

 private:
  TileVoter voter_;
  cv::Rect tile_;
  FusionOptions options_;
  VotingKernel kernel_;
};

TEST_P(TileVotesOn, PairsFusedWhereBothHaveVotesHaveTheSameBitsUnderAllRules) {
  std::mt19937 random(3);
  for (const FusionRule rule : allFusionRules()) {
    for (const FusionOrder order : {FusionOrder::kCamerasThenTime, FusionOrder::kTimeThenCameras}) {
      for (const cv::Rect& tile : kTiles) {
        PairsOnATile pairs(GetParam(), tile, {rule, FusionRule::kArithmetic, order});
        for (const std::size_t groups : {1U, 3U}) {
          std::vector<std::vector<TileRays>> rays(2);
          for (auto& of_camera : rays) {
            for (std::size_t group = 0; group < groups; ++group) {
              of_camera.push_back(pairs.rays(random, kCounts[random() % 6]));
            }
          }
          pairs.expectSameBits(std::move(rays));
        }
      }
    }
  }
}

}  // namespace
}  // namespace efm
