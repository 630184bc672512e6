// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/presets/presets.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "mapping/geometry/trajectory.h"

namespace efm {
namespace {

TEST(DeskStereo, PosesInterpolateToFarBelowAHundredthOfAPixel) {
  const Simulation desk = makeDeskStereo(1);
  Trajectory trajectory;
  for (const StampedPose& pose : samplePoses(desk)) trajectory.add(pose);
  const Eigen::Vector3d p_cam(0.3, 0.2, 0.6);  // at the min depth
  for (std::int64_t t_ns = desk.start_ns + 500'000; t_ns < desk.endNs(); t_ns += 7'000'000) {
    const Eigen::Vector3d p_world = desk.motion->poseAt(t_ns) * p_cam;
    const Eigen::Vector3d p_interpolated = trajectory.poseAt(t_ns)->inverse() * p_world;
    const CameraModel& model = desk.rig.cameras[0].model;
    EXPECT_LT((model.project(p_interpolated) - model.project(p_cam)).norm(), 0.002);
  }
}

TEST(DeskStereo, FiresAboutAMillionEventsPerCamera) {
  // Every twentieth interval of 20 ms of one camera.
  Simulation desk = makeDeskStereo(1);
  desk.rig.cameras.resize(1);
  const std::int64_t end_ns = desk.endNs();
  desk.duration_ns = 20'000'000;
  std::size_t events = 0;
  for (; desk.start_ns < end_ns; desk.start_ns += 20 * desk.duration_ns) {
    const std::vector<Event> fired = simulateEvents(desk)[0].events;
    EXPECT_LT(fired.front().t_ns - desk.start_ns, 1'000'000) << "the pixels run from the start";
    events += fired.size();
  }
  EXPECT_GE(20 * events, 800'000U);
  EXPECT_LE(20 * events, 1'200'000U);
}

}  // namespace
}  // namespace efm
