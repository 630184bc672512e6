// SPDX-License-Identifier: BSD-3-Clause
// Tests that the maps of single cameras tell what is wrong between two cameras, on the simulated
// desk.
#include "mapping/survey/camera_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "test/integration/simulated_recording.h"

namespace efm {
namespace {

class CameraCheckOnTheDesk : public ::testing::Test {
 protected:
  static const test::SimulatedRecording& desk() { return test::SimulatedRecording::desk(); }

  /// Returns a sample of the recording's first seconds. @param travel factor of the positions.
  static std::vector<WindowSample> samples(double length_s, double travel = 1) {
    Trajectory trajectory;
    for (StampedPose pose : desk().poses()) {
      pose.T_world_rig.translation *= travel;
      trajectory.add(pose);
    }
    const std::int64_t t0_ns = desk().simulation().start_ns;
    const std::int64_t t1_ns = t0_ns + static_cast<std::int64_t>(1e9 * length_s);
    WindowData data{{t0_ns, t1_ns, (t0_ns + t1_ns) / 2}, {}, &trajectory};
    for (const std::vector<Event>& camera : desk().events()) {
      const auto end = std::find_if(camera.begin(), camera.end(),
                                    [&](const Event& event) { return event.t_ns >= t1_ns; });
      data.events.emplace_back(camera.data(), camera.data() + (end - camera.begin()));
    }
    return {sampleOf(data)};
  }

  static FusionMapperOptions options() {
    FusionMapperOptions options;
    options.keyframe.planes = {0.55, 5.0, 100, PlaneSpacing::kInverse};
    return options;
  }
};

TEST_F(CameraCheckOnTheDesk, NamesTheFaultAndUndoesIt) {
  const Rig& exact = desk().simulation().rig;
  const auto turned = [](const Eigen::Vector3d& degrees) {
    return [degrees](RigCamera& camera) {
      camera.T_rig_cam = camera.T_rig_cam *
                         Rigid3{rotationBy(kRadiansPerDegree * degrees), Eigen::Vector3d::Zero()};
    };
  };
  const struct {
    const char* name;
    CameraFault fault;
    std::function<void(RigCamera&)> make;
  } kFaults[] = {
      {"exact", CameraFault::kNone, [](RigCamera&) {}},
      {"across", CameraFault::kAcross, turned({0.3, 0, 0})},
      {"along", CameraFault::kAlong, turned({0, -0.5, 0})},
      {"roll", CameraFault::kRoll, turned({0, 0, 0.4})},
      {"focal length", CameraFault::kFocalLength,
       [](RigCamera& camera) { camera.model.fx *= 1.02, camera.model.fy *= 1.02; }},
  };
  constexpr double kToleranceDeg = 0.12;  // a third of a pixel; measured: up to 0.07
  for (const auto& fault : kFaults) {
    SCOPED_TRACE(fault.name);
    Rig rig = exact;
    fault.make(rig.cameras[1]);
    const auto found = compareCameras(rig, samples(1.6), options());
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].camera, 1);
    EXPECT_EQ(found[0].other, 0);
    EXPECT_EQ(found[0].fault, fault.fault);
    const Rigid3 undone =
        rig.cameras[1].T_rig_cam * Rigid3{found[0].R_cam_fitted, Eigen::Vector3d::Zero()};
    EXPECT_NEAR(undone.rotation.angularDistance(exact.cameras[1].T_rig_cam.rotation), 0,
                kToleranceDeg * kRadiansPerDegree);
    EXPECT_EQ(found[0].scale, 1);
    if (fault.fault != CameraFault::kNone) {
      EXPECT_GT(sharpnessGain(found[0], 1, rig, samples(1.6), options()), 1.005);
    }
    EXPECT_NEAR(found[0].zoom * rig.cameras[1].model.fx / exact.cameras[1].model.fx, 1, 0.005);
  }
}

TEST_F(CameraCheckOnTheDesk, TellsAScaleOfThePosesFromAFault) {
  const Rig& rig = desk().simulation().rig;
  for (const double travel : {0.5, 2.0, 10.0}) {
    SCOPED_TRACE(travel);
    FusionMapperOptions scaled = options();
    scaled.keyframe.planes.min_depth_m *= travel;  // as automatic limits do
    scaled.keyframe.planes.max_depth_m *= travel;
    const auto found = compareCameras(rig, samples(1.6, travel), scaled);
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].fault, CameraFault::kNone);
    EXPECT_NEAR(found[0].scale, travel, 0.1 * travel);
    EXPECT_GT(sharpnessGain({}, 1 / travel, rig, samples(1.6, travel), scaled), 1.2);
  }
}

TEST_F(CameraCheckOnTheDesk, ComparesNothingInAShortTimeOrWithOneCamera) {
  EXPECT_TRUE(compareCameras(desk().simulation().rig, samples(0.3), options()).empty());
  FusionMapperOptions one = options();
  one.cameras = {1};
  EXPECT_TRUE(compareCameras(desk().simulation().rig, samples(1.6), one).empty());
  EXPECT_TRUE(compareCameras(desk().simulation().rig, {}, options()).empty());
}

}  // namespace
}  // namespace efm
