// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/option_choice.h"

#include <gmock/gmock.h>

#include "test/mapping/survey/edge_world.h"

namespace efm {
namespace {

using test::EdgeWorld;

constexpr AutomaticOptions kAll{true, true, true, true, true};

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
    // The limits are around nearly all edges and less than 10 times apart; the rig moves by 0.25 m.
    EXPECT_LT(planes.min_depth_m, 0.9 * factor);
    EXPECT_GT(planes.min_depth_m, 0.3 * factor);
    EXPECT_GT(planes.max_depth_m, 2.5 * factor);
    EXPECT_LT(planes.max_depth_m, 9 * factor);
    EXPECT_LE(options.policy.window_s, 0.5);  // a quarter of the recording
    EXPECT_EQ(options.policy.stride_s, options.policy.window_s / 2);
  }
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
}

}  // namespace
}  // namespace efm
