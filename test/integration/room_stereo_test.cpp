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
  options.keyframes.window_s = 0.3;
  options.keyframes.stride_s = 0.3;
  options.keyframe.planes = {0.9, 7.0, 100, PlaneSpacing::kInverse};

  const auto keyframes = room.map(options);
  EXPECT_EQ(keyframes.size(), 5U);
  const auto points = test::globalCloudOf(keyframes);
  ASSERT_GT(points.size(), 10'000U);
  const double median_m = room.medianDistanceToSurfaces(points);
  std::cout << "map: " << points.size() << " points, median distance to the surfaces "
            << 100 * median_m << " cm\n";
  // A plane step is 1 % of the range of inverse depth: 2 cm at 1.4 m, 9 cm at 3 m.
  EXPECT_LE(median_m, 0.06);
}

}  // namespace
}  // namespace efm
