// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/presets/desk_stereo.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/geometry/trajectory.h"
#include "tracking_stub/presets/simulation_preset.h"
#include "tracking_stub/rendering/depth_rendering.h"

namespace efm {
namespace {

TEST(DeskStereo, EveryPixelSeesSomethingWithinItsRange) {
  const Simulation desk = makeDeskStereo(1);
  for (const RigCamera& camera : desk.rig.cameras) {
    for (std::int64_t t_ns = desk.start_ns; t_ns <= desk.endNs(); t_ns += 20'000'000) {
      const Rigid3 T_world_cam = desk.motion->poseAt(t_ns) * camera.T_rig_cam;
      const cv::Mat1f depth = renderDepth(desk.scene, T_world_cam, ReferenceView::of(camera.model));
      const auto [nearest, farthest] = std::minmax_element(depth.begin(), depth.end());
      EXPECT_GE(*nearest, 0.6F);
      EXPECT_LE(*farthest, 4.5F);
    }
  }
}

TEST(DeskStereo, PosesInterpolateToFarBelowAHundredthOfAPixel) {
  const Simulation desk = makeDeskStereo(1);
  Trajectory trajectory;
  for (const StampedPose& pose : samplePoses(desk)) trajectory.add(pose);
  const Eigen::Vector3d p_cam(0.3, 0.2, 0.6);  // as near as anything comes
  for (std::int64_t t_ns = desk.start_ns + 500'000; t_ns < desk.endNs(); t_ns += 1'000'000) {
    const Eigen::Vector3d p_world = desk.motion->poseAt(t_ns) * p_cam;
    const Eigen::Vector3d p_interpolated = trajectory.poseAt(t_ns)->inverse() * p_world;
    const CameraModel& model = desk.rig.cameras[0].model;
    EXPECT_LT((model.project(p_interpolated) - model.project(p_cam)).norm(), 0.002);
  }
}

/// A tenth of the recording, from where motion and rate are average.
class DeskStereoEvents : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    desk = new Simulation(makeDeskStereo(1));
    desk->duration_ns /= 10;
    recordings = simulateEvents(*desk);
  }
  static void TearDownTestSuite() {
    delete desk;
    desk = nullptr;
  }
  static Simulation* desk;
  static std::vector<CameraRecording> recordings;
};

Simulation* DeskStereoEvents::desk = nullptr;
std::vector<CameraRecording> DeskStereoEvents::recordings;

TEST_F(DeskStereoEvents, StartWithinAMillisecondOfTheRecording) {
  for (const CameraRecording& recording : recordings) {
    EXPECT_LT(recording.events.front().t_ns - desk->start_ns, 1'000'000);
  }
}

TEST_F(DeskStereoEvents, ComeFromPlacesThatProjectToTheirPixels) {
  for (std::size_t c = 0; c < recordings.size(); ++c) {
    const RigCamera& camera = desk->rig.cameras[c];
    double worst_px = 0;
    for (std::size_t i = 0; i < recordings[c].events.size(); i += 7) {
      const Event& event = recordings[c].events[i];
      const Rigid3 T_world_cam = desk->motion->poseAt(event.t_ns) * camera.T_rig_cam;
      const Eigen::Vector3d p_world = desk->scene.pointAt(recordings[c].sources[i]);
      const Eigen::Vector2d pixel = camera.model.project(T_world_cam.inverse() * p_world);
      worst_px = std::max(worst_px, (pixel - Eigen::Vector2d(event.x, event.y)).norm());
    }
    EXPECT_LT(worst_px, 1.0);
  }
}

TEST(DeskStereo, FiresAboutAMillionEventsPerCamera) {
  // Every tenth stretch of 20 ms, one camera: the whole would take ten times as long.
  Simulation desk = makeDeskStereo(1);
  desk.rig.cameras.resize(1);
  const std::int64_t end_ns = desk.endNs();
  desk.duration_ns = 20'000'000;
  std::size_t events = 0;
  for (; desk.start_ns < end_ns; desk.start_ns += 10 * desk.duration_ns) {
    events += simulateEvents(desk)[0].events.size();
  }
  EXPECT_GE(10 * events, 800'000U);
  EXPECT_LE(10 * events, 1'200'000U);
}

}  // namespace
}  // namespace efm
