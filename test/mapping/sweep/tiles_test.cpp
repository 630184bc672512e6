// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <Eigen/Core>

#include <algorithm>
#include <random>
#include <vector>

#include "mapping/kernels/kernels.h"
#include "mapping/sweep/space_sweep.h"
#include "mapping/sweep/tiles.h"
#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/sweep/sweep_case.h"

namespace efm {
namespace {

using Points = std::vector<Eigen::Vector2d>;

constexpr double kLastFraction = 4095.0 / 4096;

struct TileVotes {
  std::vector<float> density;
  std::uint64_t units = 0;  // sum of all weights
};

constexpr std::uint64_t kUnitsOfVote = 1U << kernels::kWeightBits;

TileVotes voteWith(TileAccumulator& accumulator, const cv::Rect& tile, const Points& points) {
  const TileCells cells(tile, test::kTiledView);
  accumulator.moveTo(cells);
  TileRays rays = test::raysAt(points, cells.origin);
  TileVotes result{std::vector<float>(static_cast<std::size_t>(tile.area()), -1.0F), 0};
  accumulator.vote(rays, 0);
  result.units = accumulator.resolve(result.density.data());
  return result;
}

/// Votes on the whole view, tile by tile.
TileVotes voteOnView(VotingKernel kernel, const Points& points) {
  TileAccumulator accumulator(kernel);
  TileVotes all{std::vector<float>(test::kTiledView.pixels(), -1.0F), 0};
  for (const cv::Rect& tile : tilesOf(test::kTiledView, TileCells::kMaxPixels)) {
    const TileVotes part = voteWith(accumulator, tile, points);
    for (int y = 0; y < tile.height; ++y) {
      std::copy_n(part.density.begin() + y * tile.width, tile.width,
                  all.density.begin() + (tile.y + y) * test::kTiledView.width + tile.x);
    }
    all.units += part.units;
  }
  return all;
}

/// Votes of the plain kernel, cast one by one. Sums are in double: sums of many floats are rounded.
struct VotesOneByOne {
  std::vector<double> density;
  std::uint64_t votes = 0;
};

VotesOneByOne voteOneByOne(const Points& points) {
  VotesOneByOne all{std::vector<double>(test::kTiledView.pixels(), 0.0), 0};
  std::vector<float> plane(test::kTiledView.pixels(), 0.0F);
  for (const Eigen::Vector2d& point : points) {
    const auto x = static_cast<float>(point.x());
    const auto y = static_cast<float>(point.y());
    if (kernels::voteBilinear({&x, &y}, {0, 1, 1, 0, 0},
                              {plane.data(), test::kTiledView.width, test::kTiledView.height}) ==
        0) {
      continue;
    }
    ++all.votes;
    const auto corner = static_cast<std::size_t>(y) * 150 + static_cast<std::size_t>(x);
    for (const std::size_t pixel : {corner, corner + 1, corner + 150, corner + 151}) {
      all.density[pixel] += double{plane[pixel]};
      plane[pixel] = 0;
    }
  }
  return all;
}

/// @param per_vote largest error of a weight.
void expectPlainVotes(VotingKernel kernel, const Points& points, double per_vote) {
  const TileVotes fast = voteOnView(kernel, points);
  const VotesOneByOne plain = voteOneByOne(points);
  EXPECT_EQ(fast.units, plain.votes * kUnitsOfVote);
  for (std::size_t i = 0; i < plain.density.size(); ++i) {
    // Float weights of a vote and sums of full cells: at most one rounding per 64 votes.
    const double rounding = 1.2e-7 * (1 + static_cast<double>(points.size()) / 64);
    ASSERT_NEAR(fast.density[i], plain.density[i],
                per_vote * static_cast<double>(points.size()) + rounding * (1 + plain.density[i]))
        << "at " << i % 150 << ", " << i / 150 << ", first ray at " << points.front().transpose();
  }
}

/// The largest error of a weight: half a unit for the row plus half a unit for the column.
constexpr double kWeightError = 1.0 / (1 << kernels::kWeightBits);

class TileAccumulatorOn : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, TileAccumulatorOn, ::testing::ValuesIn(test::fastKernels()),
                         test::nameOfKernel);

TEST_P(TileAccumulatorOn, ThousandsOfVotesInOneVoxelAreThePlainKernelsAndAllCounted) {
  // Tiles begin at columns 50 and 100, and at rows 43 and 86.
  for (const auto& corner : Points{{20, 20},
                                   {0, 0},
                                   {49, 42},
                                   {50, 43},
                                   {48, 41},
                                   {49, 10},
                                   {50, 10},
                                   {10, 85},
                                   {10, 86},
                                   {148, 0},
                                   {0, 128},
                                   {148, 128}}) {
    for (const auto& [fraction, fits] :
         std::vector<std::pair<Eigen::Vector2d, bool>>{{{0, 0}, true},
                                                       {{0.5, 0.5}, true},
                                                       {{0.25, 0.75}, true},
                                                       {{0, kLastFraction}, false},
                                                       {{kLastFraction, 0}, false},
                                                       {{1.0 / 4096, 1.0 / 4096}, false},
                                                       {{0.3330078125, 0.7001953125}, false},
                                                       {{kLastFraction, kLastFraction}, false}}) {
      expectPlainVotes(GetParam(), Points(10'000, corner + fraction), fits ? 0 : kWeightError);
    }
  }
}

TEST_P(TileAccumulatorOn, ACellMayFillUpAtAnyVote) {
  for (const std::size_t votes :
       {1U, 62U, 63U, 64U, 65U, 127U, 128U, 129U, 191U, 192U, 255U, 256U, 257U, 4096U}) {
    for (const double fraction : {0.0, 0.5, kLastFraction}) {
      expectPlainVotes(GetParam(), Points(votes, {30 + fraction, 20 + fraction}), kWeightError);
    }
  }
}

TEST_P(TileAccumulatorOn, EveryCellOfTheLargestTileMayBeFullAtOnce) {
  constexpr int kVotes = 65;
  const cv::Rect tile(20, 20, TileCells::kMaxPixels, TileCells::kMaxPixels);
  for (const double fraction : {0.0, 0.25, kLastFraction}) {
    Points points;
    for (int vote = 0; vote < kVotes; ++vote) {
      for (int y = 0; y < kernels::kTileCells; ++y) {
        for (int x = 0; x < kernels::kTileCells; ++x) {
          points.emplace_back(19 + x + fraction, 19 + y + fraction);
        }
      }
    }
    TileAccumulator accumulator(GetParam());
    const TileVotes votes = voteWith(accumulator, tile, points);
    EXPECT_EQ(votes.units, std::uint64_t{kVotes} * 63 * 63 * kUnitsOfVote);
    // The four weights around a pixel add up to one vote for any fraction.
    for (const float density : votes.density) ASSERT_NEAR(density, kVotes, 1e-4) << fraction;
  }
}

/// Tiles with and without a rest of vectors, in the middle and on each border of the view.
const std::vector<cv::Rect> kTiles = {{0, 0, 63, 63},   {50, 43, 50, 43}, {87, 67, 63, 63},
                                      {20, 30, 1, 1},   {149, 0, 1, 63},  {60, 129, 17, 1},
                                      {30, 40, 16, 20}, {31, 41, 33, 3},  {0, 100, 48, 30}};

/// Draws rays in and around a tile, in clusters: most cells are empty if there are few rays.
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

/// Numbers of rays: from none up to full cells.
const std::vector<std::size_t> kCounts = {0, 1, 9, 60, 400, 3000, 90'000};

class TileFusionOn : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, TileFusionOn, ::testing::ValuesIn(test::fastKernels()),
                         test::nameOfKernel);

/// Fuses the inputs of a tile on two planes by `PlaneFusion` alone.
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
            for (TileFusion* of : {&fusion, &keeping}) {
              PlaneValues fused(expected.size() + kernels::kSumPadding);
              of->fuse(rays, 0, fused.data());
              fused.resize(expected.size());
              ASSERT_EQ(fused, expected);
            }
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
