// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/keyframe_registration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "edges.h"
#include "mapping/geometry/rigid3.h"
#include "random_poses.h"
#include "test/maps/refusals.h"

namespace efm {
namespace {

using test::drawMotion;
using test::Edges;
using test::kInverseDepthSigma;
using test::metresApart;
using test::priorOf;
using test::radiansApart;
using test::seenFrom;
using test::viewTurned;

/// Two views of a world a step apart; the first is the map.
struct Step {
  Rigid3 T_world_map = viewTurned(0, {0, 0, 0});
  Rigid3 T_world_ref = viewTurned(4 * kRadiansPerDegree, {0.15, 0.02, 0.05});
  RegistrationCloud map;
  RegistrationCloud cloud;

  Step(const Edges& world, std::mt19937& random, double sigma = kInverseDepthSigma)
      : map(seenFrom(world, T_world_map, sigma, random), {}),
        cloud(seenFrom(world, T_world_ref, sigma, random), {}) {}

  Registration from(const PosePrior& prior, const KeyframeRegistrationOptions& options = {}) const {
    return registerKeyframe(1, cloud, {{0, &map, T_world_map}}, prior, options);
  }
};

TEST(KeyframeRegistration, FindsAPoseThatThePriorMissesByTwoCentimetresAndADegree) {
  constexpr int kSeeds = 8;
  double squared_m = 0;
  double squared_rad = 0;
  double squared_sigmas = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    std::mt19937 random(seed);
    const Step step(test::edgesAround(150, random), random);
    const Rigid3 prior = step.T_world_ref * drawMotion(0.02, 1 * kRadiansPerDegree, random);
    const Registration found = step.from(priorOf(prior, 0.02, 1 * kRadiansPerDegree));
    squared_m += std::pow(metresApart(found.T_world_ref, step.T_world_ref), 2);
    squared_rad += std::pow(radiansApart(found.T_world_ref, step.T_world_ref), 2);
    EXPECT_GT(found.inlierRatio(), 0.6) << seed;
    EXPECT_LE(found.inliers, found.visible) << seed;
    EXPECT_LE(found.visible, step.cloud.numQueryPoints()) << seed;
    EXPECT_GT(found.from_prior, 0.5) << seed;
    EXPECT_LT(found.median_error, 1) << seed;
    ASSERT_EQ(found.factors.size(), 1U);
    const RelativePoseFactor& factor = found.factors[0];
    EXPECT_EQ(factor.from, 0U);
    EXPECT_EQ(factor.to, 1U);
    EXPECT_FALSE(factor.robust);
    squared_sigmas += std::pow(errorOf(factor, step.T_world_map, step.T_world_ref), 2) -
                      std::pow(errorOf(factor, step.T_world_map, found.T_world_ref), 2);
  }
  // Pixels of 0.44 deg, 1.3 cm wide at 3 m, and some 800 points, each of which says something
  // across its edge alone: 6.6 mm and 0.15 deg, as rotation and translation go together.
  EXPECT_LT(std::sqrt(squared_m / kSeeds), 0.009);
  EXPECT_LT(std::sqrt(squared_rad / kSeeds), 0.2 * kRadiansPerDegree);
  // Chi-squared of 48 degrees of freedom: above 75 for 1 % of draws.
  EXPECT_LT(squared_sigmas, 75);
  EXPECT_GT(squared_sigmas, 5);
}

TEST(KeyframeRegistration, FindsAPoseThatAnUncertainPriorMissesByManyPixels) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    std::mt19937 random(seed);
    const Step step(test::edgesAround(150, random), random);
    const Rigid3 off = viewTurned(3 * kRadiansPerDegree, {0.06, -0.04, 0.03});  // 7 px and 2 px
    const Registration found =
        step.from(priorOf(step.T_world_ref * off, 0.05, 2 * kRadiansPerDegree));
    // Twice the errors with the more certain prior above.
    EXPECT_LT(metresApart(found.T_world_ref, step.T_world_ref), 0.018) << seed;
    EXPECT_LT(radiansApart(found.T_world_ref, step.T_world_ref), 0.4 * kRadiansPerDegree) << seed;
  }
}

TEST(KeyframeRegistration, SeveralKeyframesGiveAFactorEach) {
  std::mt19937 random(3);
  const Edges world = test::edgesAround(150, random);
  const Step step(world, random);
  const Rigid3 T_world_other = viewTurned(-3 * kRadiansPerDegree, {-0.1, 0, 0});
  const RegistrationCloud other(seenFrom(world, T_world_other, kInverseDepthSigma, random), {});
  const RegistrationCloud nothing(test::emptyKeyframe(test::smallView()), {});
  const std::vector<MapKeyframe> map = {
      {7, &step.map, step.T_world_map}, {3, &nothing, T_world_other}, {5, &other, T_world_other}};
  const Rigid3 prior = step.T_world_ref * drawMotion(0.02, 1 * kRadiansPerDegree, random);
  const Registration found =
      registerKeyframe(9, step.cloud, map, priorOf(prior, 0.02, 1 * kRadiansPerDegree), {});
  ASSERT_EQ(found.factors.size(), 2U);
  EXPECT_EQ(found.factors[0].from, 7U);
  EXPECT_EQ(found.factors[1].from, 5U);
  for (const RelativePoseFactor& factor : found.factors) EXPECT_EQ(factor.to, 9U);
  EXPECT_LT(metresApart(found.T_world_ref, step.T_world_ref), 0.006);
}

TEST(KeyframeRegistration, ItsFactorsHaveTheirMinimumAtItsPose) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    std::mt19937 random(seed);
    const Step step(test::edgesAround(150, random), random);
    const Rigid3 off = step.T_world_ref * drawMotion(0.02, 1 * kRadiansPerDegree, random);
    // With an uncertain prior the points determine the pose.
    const Registration found = step.from(priorOf(off, 0.5, 0.2));
    // The minimum may be off by the motion of the last round.
    const RelativePoseFactor& factor = found.factors[0];
    const Vector6d minimum = -(factor.sqrt_information.transpose() * factor.sqrt_information +
                               1e-6 * Matrix6d::Identity())
                                  .ldlt()
                                  .solve(factor.sqrt_information.transpose() * factor.offset);
    EXPECT_LT(minimum.head<3>().norm(), 0.003) << seed;
    EXPECT_LT(minimum.tail<3>().norm(), 0.1 * kRadiansPerDegree) << seed;
  }
}

TEST(KeyframeRegistration, WithoutOverlapItIsThePriorWithoutFactors) {
  std::mt19937 random(6);
  const Step step(test::edgesAround(150, random), random);
  const RegistrationCloud nothing(test::emptyKeyframe(test::smallView()), {});
  const auto stays = [](const Registration& found, const Rigid3& prior, const char* why) {
    EXPECT_LT(metresApart(found.T_world_ref, prior), 1e-12) << why;
    EXPECT_LT(radiansApart(found.T_world_ref, prior), 1e-12) << why;
    EXPECT_TRUE(found.factors.empty()) << why;
    EXPECT_EQ(found.inliers, 0U) << why;
    EXPECT_EQ(found.inlierRatio(), 0) << why;
    EXPECT_EQ(found.median_error, 0) << why;
    EXPECT_NEAR(found.from_prior, 0, 1e-9) << why;
  };
  const Rigid3 behind = viewTurned(M_PI, {0, 0, 0});
  stays(step.from(priorOf(behind, 0.02, 0.02)), behind, "looks the other way");
  const Rigid3 away = viewTurned(0, {50, 0, 0});
  stays(step.from(priorOf(away, 0.02, 0.02)), away, "is elsewhere");
  const PosePrior prior = priorOf(step.T_world_ref, 0.02, 0.02);
  stays(registerKeyframe(1, nothing, {{0, &step.map, {}}}, prior, {}), step.T_world_ref,
        "no points");
  stays(registerKeyframe(1, step.cloud, {{0, &nothing, {}}}, prior, {}), step.T_world_ref,
        "no points in the map");
  stays(registerKeyframe(1, step.cloud, {}, prior, {}), step.T_world_ref, "no map");
}

TEST(KeyframeRegistration, AlongStripesItStaysWithThePrior) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    std::mt19937 random(seed);
    const Step step(test::stripes(), random);
    const Rigid3 off = step.T_world_ref * drawMotion(0.02, 0, random);
    const Registration found = step.from(priorOf(off, 0.02, 0.2 * kRadiansPerDegree));
    // A point's nearest neighbour along a stripe is nearby it, wherever it is: what holds x there
    // is chance, and rotation about y within its prior (0.2 deg at 3 m: 1 cm).
    const Eigen::Vector3d before = off.translation - step.T_world_ref.translation;
    const Eigen::Vector3d after = found.T_world_ref.translation - step.T_world_ref.translation;
    EXPECT_NEAR(after.x(), before.x(), 0.01) << seed;
    EXPECT_LT(std::abs(after.y()), 0.006) << seed;
  }
}

TEST(KeyframeRegistrationOptions, ValuesOutOfRangeAreRefusedByName) {
  using Options = KeyframeRegistrationOptions;
  test::expectRange(&Options::last_distance_px, test::kAboveZero, 16, "_distance_px");
  test::expectRange(&Options::first_distance_px, 2, 1e4, "first_distance_px");
  Options options;
  options.first_distance_px = options.last_distance_px = 1e4;
  EXPECT_EQ(messageOf([&] { options.validate(); }), "no error");
  options.alignment.max_iterations = 0;
  EXPECT_THAT(messageOf([&] { options.validate(); }), testing::HasSubstr("max_iterations = 0"));
}

}  // namespace
}  // namespace efm
