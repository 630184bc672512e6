// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/option_choice.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "mapping/survey/scene_depths.h"

namespace efm {
namespace {

/// Depths evenly spread in inverse depth.
cv::Mat1f scene(double near_m, double far_m, std::uint32_t seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> inverse(1 / far_m, 1 / near_m);
  cv::Mat1f depth(40, 50);
  for (float& depth_m : depth) depth_m = static_cast<float>(1 / inverse(random));
  return depth;
}

AutomaticOptions limits() {
  AutomaticOptions automatic;
  automatic.min_depth_m = automatic.max_depth_m = automatic.num_planes = true;
  return automatic;
}

/// The planes for a scene.
DepthPlanesOptions planesFor(double near_m, double far_m) {
  const InverseRange limits = limitsAround({1 / far_m, 1 / near_m});
  return {1 / limits.near, 1 / limits.far, 100};
}

TEST(DepthFollower, LimitsFollowAScene) {
  for (const double factor : {0.4, 2.0}) {  // nearer, farther
    DepthFollower follower(limits(), planesFor(1, 4), 100);
    for (int keyframe = 0; keyframe < 10; ++keyframe) follower.follow(scene(factor, 4 * factor));
    // Within the factor of 1.2 that noise may have.
    const DepthPlanesOptions wanted = planesFor(factor, 4 * factor);
    EXPECT_NEAR(std::log(follower.planes().min_depth_m / wanted.min_depth_m), 0, std::log(1.2));
    EXPECT_NEAR(std::log(follower.planes().max_depth_m / wanted.max_depth_m), 0, std::log(1.2));
  }
}

TEST(DepthFollower, PlanesComeBackWithTheScene) {
  struct Row {
    const char* what;
    double near_m, far_m;  // of the scene beside which something else comes
    double other_near_m, other_far_m;
    double planes_m;  // per 1/m of inverse depth
  };
  const Row rows[] = {
      {"a near object comes and goes", 1, 4, 0.2, 4, 200},
      {"the far wall comes and goes", 1, 4, 1, 40, 260},
      {"the near things go and come", 0.5, 4, 2, 4, 100},
      {"the wall goes and comes", 0.5, 10, 0.5, 1, 100},
      {"more planes than may be", 0.5, 4, 2, 8, 900},
      {"fewer planes than may be", 1, 4, 0.2, 4, 20},
  };
  for (const Row& row : rows) {
    const auto planesOf = [&](const DepthPlanesOptions& limits) {
      return std::clamp(
          std::ceil(1 + row.planes_m * (1 / limits.min_depth_m - 1 / limits.max_depth_m)), 100.0,
          400.0);
    };
    DepthPlanesOptions start = planesFor(row.near_m, row.far_m);
    start.num_planes = static_cast<int>(planesOf(start));
    DepthFollower follower(limits(), start, row.planes_m);
    std::uint32_t seed = 0;
    const auto see = [&](double near_m, double far_m) {
      for (int keyframe = 0; keyframe < 20; ++keyframe) {
        follower.follow(scene(near_m, far_m, ++seed));
        EXPECT_EQ(follower.planes().num_planes, planesOf(follower.planes())) << row.what;
      }
    };
    for (int time = 0; time < 2; ++time) {
      see(row.other_near_m, row.other_far_m);
      EXPECT_GT(std::abs(std::log(follower.planes().min_depth_m / start.min_depth_m)) +
                    std::abs(std::log(follower.planes().max_depth_m / start.max_depth_m)),
                std::log(1.25))
          << row.what;
      see(row.near_m, row.far_m);
      // The limits come back up to the factor of 1.2 that noise may have.
      EXPECT_NEAR(follower.planes().num_planes, start.num_planes, 0.25 * start.num_planes)
          << row.what;
    }
  }
}

TEST(DepthFollower, NoiseChangesNothing) {
  DepthFollower follower(limits(), planesFor(1, 4), 100);
  for (std::uint32_t seed = 0; seed < 20; ++seed) EXPECT_FALSE(follower.follow(scene(1, 4, seed)));
  EXPECT_EQ(follower.misfits(), 0);
  EXPECT_FALSE(follower.follow(cv::Mat1f(40, 50, 0.0F)));  // an empty keyframe
  cv::Mat1f few(40, 50, 0.0F);
  few.row(0) = 0.2F;  // 50 points
  EXPECT_FALSE(follower.follow(few));
  EXPECT_EQ(follower.misfits(), 2);
}

TEST(DepthFollower, ManyPointsAtAnAutomaticLimitAreAMisfit) {
  const DepthPlanesOptions planes{0.5, 5.0, 100};
  for (const bool near : {true, false}) {
    for (const double fraction : {0.055, 0.065}) {  // the limit is 6 %
      // 2 % of the range of 1.8 / m is near a limit.
      cv::Mat1f depth(50, 40, 1.0F);
      const double inverse = near ? 2 - 0.035 : 0.2 + 0.035;
      for (int i = 0; i < static_cast<int>(fraction * 2000); ++i) {
        depth(i) = static_cast<float>(1 / inverse);
      }
      for (const bool automatic : {true, false}) {
        AutomaticOptions one;
        (near ? one.min_depth_m : one.max_depth_m) = automatic;
        DepthFollower follower(one, planes, 100);
        follower.follow(depth);
        EXPECT_EQ(follower.misfits(), automatic && fraction > 0.06 ? 1 : 0) << near << fraction;
      }
    }
  }
}

TEST(DepthFollower, GivenLimitsStay) {
  AutomaticOptions only_far;
  only_far.max_depth_m = true;
  DepthFollower follower(only_far, {0.5, 4, 100}, 100);
  for (int keyframe = 0; keyframe < 10; ++keyframe) follower.follow(scene(2, 10));
  EXPECT_EQ(follower.planes().min_depth_m, 0.5);
  EXPECT_GT(follower.planes().max_depth_m, 10);
  EXPECT_EQ(follower.planes().num_planes, 100);
}

}  // namespace
}  // namespace efm
