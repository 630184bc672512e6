// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/loop_closing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "edges.h"
#include "random_poses.h"

namespace efm {
namespace {

using test::cloudFrom;
using test::covarianceOf;
using test::drawMotion;
using test::Edges;
using test::kInverseDepthSigma;
using test::metresApart;
using test::radiansApart;
using test::seenFrom;
using test::viewTurned;

std::optional<RelativePoseFactor> verify(const Rigid3& T_older_newer,
                                         const RegistrationCloud& older,
                                         const RegistrationCloud& newer, double sigma_m,
                                         double sigma_rad) {
  return verifyLoop({3, 8, T_older_newer}, older, newer, covarianceOf(sigma_m, sigma_rad), {}, {})
      .factor;
}

TEST(ViewOverlap, IsTheFractionOfPointsInView) {
  KeyframeDepthMap wall = test::emptyKeyframe(test::smallView());
  const cv::Rect inside(2, 2, 156, 116);  // as in extracted depth maps
  wall.map.depth(inside) = 2;
  wall.map.variance(inside) = 1e-4;
  const RegistrationCloud cloud(wall, {});
  EXPECT_EQ(viewOverlap(cloud, cloud, {}), 1);
  const double half_m = 80 * 2.0 / 130;  // half the image at 2 m
  EXPECT_NEAR(viewOverlap(cloud, cloud, viewTurned(0, {half_m, 0, 0})), 0.5, 0.07);
  EXPECT_EQ(viewOverlap(cloud, cloud, viewTurned(0, {2.5 * half_m, 0, 0})), 0);
  EXPECT_EQ(viewOverlap(cloud, cloud, viewTurned(M_PI, {0, 0, 0})), 0);
  const RegistrationCloud nothing(test::emptyKeyframe(test::smallView()), {});
  EXPECT_EQ(viewOverlap(nothing, cloud, {}), 0);
  EXPECT_EQ(viewOverlap(cloud, nothing, {}), 0);
}

TEST(VerifyLoop, ConfirmsTheSamePlaceAndItsPose) {
  int confirmed = 0;
  constexpr int kSeeds = 10;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    std::mt19937 random(seed);
    const Edges world = test::edgesAround(150, random);
    const Rigid3 T_world_newer = viewTurned(5 * kRadiansPerDegree, {0.1, 0.02, -0.05});
    const RegistrationCloud older = cloudFrom(world, {}, random);
    const RegistrationCloud newer = cloudFrom(world, T_world_newer, random);
    const Rigid3 expected = T_world_newer * drawMotion(0.05, 1 * kRadiansPerDegree, random);
    const auto factor = verify(expected, older, newer, 0.05, 1 * kRadiansPerDegree);
    if (!factor) continue;
    ++confirmed;
    EXPECT_EQ(factor->from, 3U);
    EXPECT_EQ(factor->to, 8U);
    EXPECT_TRUE(factor->robust);
    EXPECT_LT(metresApart(factor->T_from_to, T_world_newer), 0.012) << seed;
    EXPECT_LT(radiansApart(factor->T_from_to, T_world_newer), 0.25 * kRadiansPerDegree) << seed;
  }
  EXPECT_GE(confirmed, 8);
}

TEST(VerifyLoop, NeverTakesOnePlaceForAnother) {
  std::mt19937 random(1);
  for (int draw = 0; draw < 15; ++draw) {
    const RegistrationCloud older = cloudFrom(test::edgesAround(150, random), {}, random);
    const RegistrationCloud newer = cloudFrom(test::edgesAround(150, random), {}, random);
    EXPECT_FALSE(verify(drawMotion(0.1, 2 * kRadiansPerDegree, random), older, newer, 0.2,
                        4 * kRadiansPerDegree))
        << draw;
  }
}

TEST(VerifyLoop, NeverConfirmsAPlaceThatIsFarFromTheTruth) {
  std::mt19937 random(2);
  const Edges world = test::edgesAround(150, random);
  int confirmed = 0;
  for (int draw = 0; draw < 15; ++draw) {
    const Rigid3 T_world_newer =
        viewTurned(0, {0, 0, 0}) * drawMotion(0.1, 5 * kRadiansPerDegree, random);
    const RegistrationCloud older = cloudFrom(world, {}, random);
    const RegistrationCloud newer = cloudFrom(world, T_world_newer, random);
    const Rigid3 wrong = T_world_newer * drawMotion(0.3, 8 * kRadiansPerDegree, random);
    const auto factor = verify(wrong, older, newer, 0.3, 8 * kRadiansPerDegree);
    if (!factor) continue;
    ++confirmed;  // the pose must be right
    EXPECT_LT(metresApart(factor->T_from_to, T_world_newer), 0.05) << draw;
    EXPECT_LT(radiansApart(factor->T_from_to, T_world_newer), 1 * kRadiansPerDegree) << draw;
  }
  EXPECT_LT(confirmed, 15);
}

TEST(VerifyLoop, APlaceWithThreeTimesAsManyEdgesIsAnotherOne) {
  // All points of the newer keyframe have neighbours, but only a third of the older points.
  for (unsigned seed = 1; seed <= 5; ++seed) {
    std::mt19937 random(seed);
    Edges world = test::edgesAround(100, random);
    const Rigid3 T_world_newer = viewTurned(2 * kRadiansPerDegree, {0.05, 0, 0});
    const RegistrationCloud newer = cloudFrom(world, T_world_newer, random);
    EXPECT_TRUE(
        verify(T_world_newer, cloudFrom(world, {}, random), newer, 0.02, 0.5 * kRadiansPerDegree));
    for (const test::Edge& edge : test::edgesAround(200, random)) world.push_back(edge);
    const RegistrationCloud older = cloudFrom(world, {}, random);
    EXPECT_FALSE(verify(T_world_newer, older, newer, 0.02, 0.5 * kRadiansPerDegree)) << seed;
  }
}

TEST(VerifyLoop, FewPointsAreNotEnough) {
  std::mt19937 random(5);
  const Edges world = test::edgesAround(150, random);
  const RegistrationCloud older = cloudFrom(world, {}, random);
  KeyframeDepthMap sparse = seenFrom(world, {}, kInverseDepthSigma, random);
  test::keepFirst(99, sparse);
  EXPECT_FALSE(verify({}, older, RegistrationCloud(sparse, {}), 0.02, 0.5 * kRadiansPerDegree));
  const RegistrationCloud nothing(test::emptyKeyframe(test::smallView()), {});
  EXPECT_FALSE(verify({}, older, nothing, 0.02, 0.5 * kRadiansPerDegree));
  EXPECT_FALSE(verify({}, nothing, older, 0.02, 0.5 * kRadiansPerDegree));
  EXPECT_FALSE(verify({}, nothing, nothing, 0.02, 0.5 * kRadiansPerDegree));
}

TEST(VerifyLoop, OptionsLimitTheSigmasAndTheInliers) {
  std::mt19937 random(6);
  const Edges world = test::edgesAround(150, random);
  const RegistrationCloud older = cloudFrom(world, {}, random);
  const RegistrationCloud newer =
      cloudFrom(world, viewTurned(2 * kRadiansPerDegree, {0.05, 0, 0}), random);
  const LoopCandidate candidate{0, 1, viewTurned(2 * kRadiansPerDegree, {0.05, 0, 0})};
  const Matrix6d covariance = covarianceOf(0.02, 0.5 * kRadiansPerDegree);
  EXPECT_TRUE(verifyLoop(candidate, older, newer, covariance, {}, {}).factor);
  LoopOptions strict;
  strict.loop_max_sigma_m = 1e-5;
  EXPECT_FALSE(verifyLoop(candidate, older, newer, covariance, strict, {}).factor);
  strict = {};
  strict.loop_max_sigma_rad = 1e-6;
  EXPECT_FALSE(verifyLoop(candidate, older, newer, covariance, strict, {}).factor);
  strict = {};
  strict.loop_min_inliers = 1;
  EXPECT_FALSE(verifyLoop(candidate, older, newer, covariance, strict, {}).factor);
}

TEST(VerifyLoop, StripesDoNotConfirmAPositionAlongThem) {
  const Edges stripes = test::stripes();
  std::mt19937 random(4);
  const RegistrationCloud older = cloudFrom(stripes, {}, random);
  const RegistrationCloud newer = cloudFrom(stripes, viewTurned(0, {0.2, 0, 0}), random);
  EXPECT_FALSE(verify({}, older, newer, 0.1, 1 * kRadiansPerDegree));
}

}  // namespace
}  // namespace efm
