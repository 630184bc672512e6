// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "mapping/kernels/kernels.h"

namespace efm::kernels {
namespace {

struct Votes {
  std::vector<float> plane;
  std::uint64_t cast = 0;
};

/// One ray at (x, y) on a plane of 4 x 3 pixels.
Votes voteAt(float x, float y) {
  Votes result{std::vector<float>(12, 0.0F), 0};
  result.cast = voteBilinear({&x, &y}, {0, 1, 1, 0, 0}, {result.plane.data(), 4, 3});
  return result;
}

TEST(VotePlain, AVoteIsSharedBilinearlyAmongFourPixels) {
  const Votes votes = voteAt(1.25F, 0.5F);
  EXPECT_EQ(votes.cast, 1U);
  EXPECT_THAT(votes.plane, ::testing::ElementsAre(0, 0.375F, 0.125F, 0,  //
                                                  0, 0.375F, 0.125F, 0,  //
                                                  0, 0, 0, 0));
}

TEST(VotePlain, AVoteIsCastOnlyWhereAllFourPixelsAreInside) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(voteAt(0, 0).cast, 1U);
  EXPECT_EQ(voteAt(2.999F, 1.999F).cast, 1U);
  for (const auto& [x, y] : std::vector<std::pair<float, float>>{{-0.001F, 1},
                                                                 {1, -0.001F},
                                                                 {3, 1},
                                                                 {1, 2},
                                                                 {1e30F, 1},
                                                                 {-1e30F, 1},
                                                                 {kInfinity, 1},
                                                                 {1, -kInfinity},
                                                                 {kNan, 1},
                                                                 {1, kNan}}) {
    const Votes votes = voteAt(x, y);
    EXPECT_EQ(votes.cast, 0U) << x << ", " << y;
    EXPECT_THAT(votes.plane, ::testing::Each(0.0F)) << x << ", " << y;
  }
}

TEST(VotePlain, TheTransferScalesThenShiftsTheRaysOfItsRangeAlone) {
  const std::vector<float> x = {9, 1, 2, 9};
  const std::vector<float> y = {9, 1, 1, 9};
  std::vector<float> plane(12, 0.0F);
  EXPECT_EQ(voteBilinear({x.data(), y.data()}, {1, 3, 0.5F, 0.5F, 0.5F}, {plane.data(), 4, 3}), 2U);
  EXPECT_EQ(plane[1 * 4 + 1], 1.5F);  // (1, 1) and half of (1.5, 1)
  EXPECT_EQ(plane[1 * 4 + 2], 0.5F);
}

}  // namespace
}  // namespace efm::kernels
