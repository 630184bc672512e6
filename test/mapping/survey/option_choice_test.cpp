// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "mapping/survey/depth_agreement.h"
#include "mapping/survey/option_choice.h"
#include "mapping/survey/scene_depths.h"
#include "test/mapping/survey/edge_world.h"

namespace efm {
namespace {

using test::EdgeWorld;

constexpr AutomaticOptions kAll{true, true, true, true, true};

Rigid3 slow(double t_s) { return {Eigen::Quaterniond::Identity(), {0.02 * t_s, 0, 0}}; }

TEST(OptionChoice, LimitsEncloseTheScene) {
  for (const double factor : {1.0, 3.0}) {
    EdgeWorld world;
    world.near_m *= factor;
    world.far_m *= factor;
    const Rig rig = EdgeWorld::rig(2);
    FusionMapperOptions options;
    const auto chosen = chooseOptions(kAll, rig, {world.sample(rig)}, 2.0, options);
    EXPECT_TRUE(chosen.found_scene);
    EXPECT_EQ(chosen.options.size(), 5U);
    const DepthPlanesOptions& planes = options.keyframe.planes;
    // The limits enclose edges from 1 to 3 m. For edges from 3 to 9 m, the far limit is close to
    // the far end, because the parallax is too small beyond.
    EXPECT_NEAR(planes.min_depth_m, factor == 1 ? 0.45 : 1.6, 0.03 * factor);
    EXPECT_NEAR(planes.max_depth_m, factor == 1 ? 3.8 : 12, 0.2 * factor);
    EXPECT_EQ(planes.num_planes, automaticPlanes(planes, chosen.parallax_px_m));
    EXPECT_EQ(options.policy.stride_s, options.policy.window_s / 2);
  }
}

TEST(OptionChoice, TheWindowIsBoundByTheRecordingTheMotionAndASecond) {
  const struct {
    Rigid3 (*T_world_rig)(double);
    std::optional<double> duration_s;
    double window_s;
    const char* reason;
  } cases[] = {
      {slow, 0.3, 0.3, "the recording lasts 0.3 s"},
      {slow, 1.0, 0.5, "the recording lasts 1 s"},
      {slow, 3.1, 0.77, "the recording lasts 3.1 s"},
      {slow, 8.0, 1, "the longest that is chosen: the view moves slowly"},
      {slow, std::nullopt, 1, "the longest that is chosen: the view moves slowly"},
      // 0.2 of 160 px are 0.267 rad (focal length 120 px): 0.533 s, in steps of a factor of 1.25.
      {[](double t_s) {
         return Rigid3{rotationBy({0, 0, t_s}), {0, 0, 0}};
       },
       8.0, 0.5, "the longest in which most of the view stays in sight"},
      {[](double t_s) {
         return Rigid3{rotationBy({0, 0, 2 * t_s}), {0, 0, 0}};
       },
       1.0, 0.2, "the longest in which most of the view stays in sight"},
  };
  const Rig rig = EdgeWorld::rig(2);
  for (const auto& c : cases) {
    EdgeWorld world;
    world.T_world_rig = c.T_world_rig;
    FusionMapperOptions options;
    AutomaticOptions window;
    window.window_s = true;
    const auto chosen = chooseOptions(window, rig, {world.sample(rig)}, c.duration_s, options);
    ASSERT_EQ(chosen.options.size(), 1U) << c.reason;
    EXPECT_EQ(chosen.options[0].reason, c.reason);
    EXPECT_NEAR(options.policy.window_s, c.window_s, 1e-9) << c.reason;
  }
}

/// Returns the pose of a pan-tilt head: 10 degrees per second and a lever of some centimetres.
template <int kLeverMm>
Rigid3 panning(double t_s) {
  const Eigen::Quaterniond rotation = rotationBy({0.02 * std::sin(5 * t_s), 0.17 * t_s, 0});
  return {rotation, rotation * Eigen::Vector3d{0, 0, 1e-3 * kLeverMm}};
}

TEST(OptionChoice, LittleParallaxIsGivenALongWindowAndNeverANearScene) {
  const struct {
    Rigid3 (*T_world_rig)(double);
    bool is_proven;
    double window_s;  // lower bound
  } cases[] = {{panning<40>, false, 0.9}, {panning<200>, true, 0.6}};
  const Rig rig = EdgeWorld::rig(1);
  for (const auto& c : cases) {
    EdgeWorld world;
    world.T_world_rig = c.T_world_rig;
    world.edges = 80;
    FusionMapperOptions options;
    const auto chosen = chooseOptions(kAll, rig, {world.sample(rig)}, 1.6, options);
    EXPECT_EQ(chosen.is_proven, c.is_proven) << c.window_s;
    EXPECT_GE(options.policy.window_s, c.window_s);
    EXPECT_GT(options.keyframe.planes.max_depth_m, 1) << "the nearest edge";
    EXPECT_GT(options.keyframe.planes.min_depth_m, 0.1);
    EXPECT_LT(options.keyframe.planes.num_planes, 100);
  }
}

TEST(DepthSensitivity, IsThatOfTheSpeedAndOfTheTravel) {
  // The speed is 0.32 m/s in the middle and grows by 0.004 m/s in 10 ms.
  EdgeWorld world;
  world.T_world_rig = [](double t_s) {
    return Rigid3{Eigen::Quaterniond::Identity(), {0.2 * t_s * t_s, 0, 0}};
  };
  FusionMapperOptions options;
  options.policy.window_s = 0.4;
  for (const std::size_t cameras : {1, 2}) {
    const Rig rig = EdgeWorld::rig(cameras);
    const auto sensitivity = depthSensitivity(rig, {world.sample(rig)}, options);
    ASSERT_TRUE(sensitivity);
    const bool one = cameras == 1;
    EXPECT_NEAR(sensitivity->per_10_ms, one ? 0.0125 : 0.003, 0.004);
    ASSERT_EQ(sensitivity->per_percent_travel.has_value(), one);  // where the clock matters
    if (one) {
      EXPECT_NEAR(*sensitivity->per_percent_travel, 0.01, 0.003);
    }
    EXPECT_GT(sensitivity->sigma, 0);
  }
}

TEST(OptionChoice, PlanesAreAPixelOfParallaxApartFrom25To400) {
  EXPECT_EQ(automaticPlanes({0.5, 5.0}, 100.1), 1 + 181);
  EXPECT_EQ(automaticPlanes({0.5, 5.0}, 10), 100);
  EXPECT_EQ(automaticPlanes({0.5, 5.0}, 1000), 400);
  EXPECT_EQ(automaticPlanes({0.5, 5.0}, 2.5), 1 + 45) << "a tenth of a pixel apart";
  EXPECT_EQ(automaticPlanes({0.5, 5.0}, 0.5), 25);
}

TEST(OptionChoice, AutomaticOptionsFitTheGivenOnesUntilTheyAreChosen) {
  const auto fitted = [](AutomaticOptions automatic, double min_m, double max_m, double window_s) {
    FusionMapperOptions options;
    options.keyframe.planes.min_depth_m = min_m;
    options.keyframe.planes.max_depth_m = max_m;
    options.policy.window_s = window_s;
    options.policy.stride_s = 0.3;
    fitAutomatic(automatic, options);
    const DepthPlanesOptions& planes = options.keyframe.planes;
    return std::array<double, 4>{planes.min_depth_m, planes.max_depth_m, options.policy.window_s,
                                 options.policy.stride_s};
  };
  using Values = std::array<double, 4>;
  EXPECT_EQ(fitted({true, true}, 2, 3, 0.5), (Values{2, 3, 0.5, 0.3}));
  EXPECT_EQ(fitted({false, true}, 8, 5, 0.5), (Values{8, 80, 0.5, 0.3}));
  EXPECT_EQ(fitted({true, false}, 8, 8, 0.5), (Values{0.8, 8, 0.5, 0.3}));
  EXPECT_EQ(fitted({true, false}, 8, 0.005, 0.5), (Values{0.001, 0.005, 0.5, 0.3}));
  EXPECT_EQ(fitted({}, 8, 5, 0.2), (Values{8, 5, 0.2, 0.3}));
  EXPECT_EQ(fitted({false, false, false, false, true}, 1, 5, 0.2), (Values{1, 5, 0.2, 0.2}));
  EXPECT_EQ(fitted({false, false, false, true}, 1, 5, 0.2), (Values{1, 5, 0.3, 0.3}));
}

TEST(OptionChoice, GivenOptionsStay) {
  const Rig rig = EdgeWorld::rig(1);
  FusionMapperOptions options;
  options.keyframe.planes.min_depth_m = 2;
  options.policy.window_s = 0.33;
  AutomaticOptions automatic;
  automatic.max_depth_m = true;
  const auto chosen =
      chooseOptions(automatic, rig, {EdgeWorld().sample(rig)}, 2.0, options).options;
  ASSERT_EQ(chosen.size(), 1U);
  EXPECT_EQ(chosen[0].key, "max_depth_m");
  EXPECT_EQ(chosen[0].value, options.keyframe.planes.max_depth_m);
  EXPECT_EQ(options.keyframe.planes.min_depth_m, 2);
  EXPECT_GT(options.keyframe.planes.max_depth_m, 2);
  EXPECT_EQ(options.policy.window_s, 0.33);
}

TEST(OptionChoice, KeepsTheValuesWhereNothingIsSeen) {
  FusionMapperOptions options;
  const DepthPlanesOptions before = options.keyframe.planes;
  const auto chosen = chooseOptions(kAll, EdgeWorld::rig(1), {}, std::nullopt, options);
  EXPECT_FALSE(chosen.found_scene);
  EXPECT_EQ(chosen.options.size(), 5U);
  for (const ChosenOption& option : chosen.options) {
    EXPECT_EQ(option.reason, "the default: no event has a pose");
  }
  EXPECT_EQ(options.keyframe.planes.min_depth_m, before.min_depth_m);
  EXPECT_EQ(options.keyframe.planes.max_depth_m, before.max_depth_m);
  EXPECT_NEAR(chosen.parallax_px_m, 99 / 1.8, 1e-9) << "of 100 planes from 0.5 to 5 m";
  const auto wide = chooseWideDepths(kAll, options);
  EXPECT_FALSE(wide.found_scene);
  EXPECT_EQ(options.keyframe.planes.min_depth_m, 0.3);
  EXPECT_EQ(options.keyframe.planes.max_depth_m, 100);
  const FusionMapperOptions survey = surveyOptions(options, 0.7);
  EXPECT_EQ(survey.policy.window_s, 0.7);
  EXPECT_EQ(survey.policy.stride_s, 0.7);

  // A single camera at rest measures no depth, whatever moves in front of it.
  const Rig one = EdgeWorld::rig(1);
  WindowSample still = EdgeWorld().sample(one);
  Trajectory fixed;
  for (const StampedPose& pose : still.trajectory.poses()) fixed.add({pose.t_ns, Rigid3()});
  still.trajectory = fixed;
  FusionMapperOptions of_still;
  EXPECT_FALSE(chooseOptions(kAll, one, {still}, std::nullopt, of_still).found_scene);
  EXPECT_EQ(of_still.keyframe.planes.min_depth_m, before.min_depth_m);
}

/// Draws depths that are uniform in inverse depth.
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

/// Returns the planes for a scene.
DepthPlanesOptions planesFor(double near_m, double far_m) {
  const InverseRange limits = limitsAround({1 / far_m, 1 / near_m});
  return {1 / limits.near, 1 / limits.far, 100};
}

TEST(DepthFollower, LimitsFollowAScene) {
  for (const double factor : {0.4, 2.0}) {  // nearer or farther
    DepthFollower follower(limits(), planesFor(1, 4), 100);
    for (int keyframe = 0; keyframe < 10; ++keyframe) follower.follow(scene(factor, 4 * factor));
    // Noise may change the limits by a factor of up to 1.2.
    const DepthPlanesOptions wanted = planesFor(factor, 4 * factor);
    EXPECT_NEAR(std::log(follower.planes().min_depth_m / wanted.min_depth_m), 0, std::log(1.2));
    EXPECT_NEAR(std::log(follower.planes().max_depth_m / wanted.max_depth_m), 0, std::log(1.2));
  }
}

TEST(DepthFollower, PlanesComeBackWithTheScene) {
  struct Row {
    const char* what;
    double near_m, far_m;  // limits of the scene at the start
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
      // The limits come back, up to the factor of 1.2 that noise may have.
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
      // Depths within 2 % of the range of 1.8 1/m are near a limit.
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
