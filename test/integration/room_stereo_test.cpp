// SPDX-License-Identifier: BSD-3-Clause
// A walk around a room, end to end.
#include <gtest/gtest.h>

#include <iostream>

#include "test/integration/simulated_recording.h"

namespace efm {
namespace {

TEST(RoomStereo, TheMapLiesOnTheTrueSurfaces) {
  SimulationOptions simulation;
  simulation.preset = "room_stereo";
  simulation.duration_s = 1.6;  // of 8 s around the room; the whole takes five times as long
  const test::SimulatedRecording room(simulation);
  FusionMapperOptions options;
  options.policy.window_s = 0.3;
  options.policy.stride_s = 0.3;
  options.keyframe.planes = {0.9, 7.0, 100, PlaneSpacing::kInverse};

  const auto keyframes = room.map(options);
  EXPECT_EQ(keyframes.size(), 6U);  // the last window is moved back to the end
  const auto points = test::globalCloudOf(keyframes);
  ASSERT_GT(points->size(), 10'000U);
  const double median_m = room.medianDistanceToSurfaces(*points);
  std::cout << "map: " << points->size() << " points, median distance to the surfaces "
            << 100 * median_m << " cm\n";
  // A plane step is 1 % of the range of inverse depth: 2 cm at 1.4 m, 9 cm at 3 m.
  EXPECT_LE(median_m, 0.06);

  // What keyframes say of each other takes outliers, and little else.
  GlobalCloudOptions map;
  const double share = room.shareBeyond(*points, 0.2);
  map.consistency.consistency = Consistency::kNone;
  const auto all = test::globalCloudOf(keyframes, map);
  const double share_of_all = room.shareBeyond(*all, 0.2);
  map.consistency.consistency = Consistency::kVisibility;
  map.min_keyframes = 2;
  const auto seen_twice = test::globalCloudOf(keyframes, map);
  const double share_of_seen_twice = room.shareBeyond(*seen_twice, 0.2);
  std::cout << "beyond 20 cm: " << share_of_all << " of all " << all->size() << " points, " << share
            << " by visibility, " << share_of_seen_twice << " of the " << seen_twice->size()
            << " that two keyframes saw\n";
  EXPECT_LT(share, 0.85 * share_of_all);
  EXPECT_GT(points->size(), all->size() * 97 / 100);
  EXPECT_LT(share_of_seen_twice, 0.02);
  EXPECT_GT(seen_twice->size(), all->size() * 80 / 100);
}

}  // namespace
}  // namespace efm
