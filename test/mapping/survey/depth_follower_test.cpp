// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/depth_follower.h"

#include <gmock/gmock.h>

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
    DepthFollower follower(limits(), planesFor(1, 4));
    for (int keyframe = 0; keyframe < 10; ++keyframe) follower.follow(scene(factor, 4 * factor));
    // Within the factor of 1.2 that noise may have.
    const DepthPlanesOptions wanted = planesFor(factor, 4 * factor);
    EXPECT_NEAR(std::log(follower.planes().min_depth_m / wanted.min_depth_m), 0, std::log(1.2));
    EXPECT_NEAR(std::log(follower.planes().max_depth_m / wanted.max_depth_m), 0, std::log(1.2));
  }
}

TEST(DepthFollower, NoiseChangesNothing) {
  DepthFollower follower(limits(), planesFor(1, 4));
  for (std::uint32_t seed = 0; seed < 20; ++seed) EXPECT_FALSE(follower.follow(scene(1, 4, seed)));
  EXPECT_FALSE(follower.follow(cv::Mat1f(40, 50, 0.0F)));  // an empty keyframe
  cv::Mat1f few(40, 50, 0.0F);
  few.row(0) = 0.2F;  // 50 points
  EXPECT_FALSE(follower.follow(few));
}

TEST(DepthFollower, GivenLimitsStay) {
  AutomaticOptions only_far;
  only_far.max_depth_m = true;
  DepthFollower follower(only_far, {0.5, 4, 100});
  for (int keyframe = 0; keyframe < 10; ++keyframe) follower.follow(scene(2, 10));
  EXPECT_EQ(follower.planes().min_depth_m, 0.5);
  EXPECT_GT(follower.planes().max_depth_m, 10);
  EXPECT_EQ(follower.planes().num_planes, 100);
}

}  // namespace
}  // namespace efm
