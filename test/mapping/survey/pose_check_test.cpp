// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/survey/pose_check.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <functional>

#include "test/mapping/survey/edge_world.h"

namespace efm {
namespace {

using test::EdgeWorld;

struct Recorded {
  Rig rig;
  WindowSample sample;

  /// Changes each pose.
  void change(const std::function<StampedPose(const StampedPose&)>& changed) {
    Trajectory trajectory;
    for (const StampedPose& pose : sample.trajectory.poses()) trajectory.add(changed(pose));
    sample.trajectory = trajectory;
  }
  std::optional<PoseFinding> check() const { return checkPoses(rig, {sample}, {}); }
};

Recorded recorded(std::size_t cameras, const EdgeWorld& world = {}) {
  const Rig rig = EdgeWorld::rig(cameras);
  return {rig, world.sample(rig)};
}

/// x forward, y left, z up; the camera's are z, -x, -y.
Eigen::Matrix3d forwardLeftUp() {
  Eigen::Matrix3d R_body_rig;
  R_body_rig << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return R_body_rig;
}

template <int kMs>
void later(Recorded& recorded) {
  recorded.change([](StampedPose pose) {
    pose.t_ns += std::int64_t{kMs} * 1'000'000;
    return pose;
  });
}

struct Row {
  const char* name;
  PoseMistake found;
  bool one_camera;  // finds it, too
  void (*make)(Recorded&);
  double shift_s = 0;
};

const Row kRows[] = {
    {"T_rig_world instead of T_world_rig", PoseMistake::kInverted, true,
     [](Recorded& recorded) {
       recorded.change([](StampedPose pose) {
         return StampedPose{pose.t_ns, pose.T_world_rig.inverse()};
       });
     }},
    {"w x y z read as x y z w", PoseMistake::kQuaternionOrder, true,
     [](Recorded& recorded) {
       recorded.change([](StampedPose pose) {
         const Eigen::Quaterniond q = pose.T_world_rig.rotation;
         pose.T_world_rig.rotation = Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y());
         return pose;
       });
     }},
    {"poses of a body with other axes", PoseMistake::kAxes, true,
     [](Recorded& recorded) {
       recorded.change([](StampedPose pose) {
         const Rigid3 T_rig_body{Eigen::Quaterniond(forwardLeftUp().transpose()),
                                 Eigen::Vector3d::Zero()};
         pose.T_world_rig = pose.T_world_rig * T_rig_body;
         return pose;
       });
     }},
    {"poses 0.2 s late", PoseMistake::kTimeShift, true, later<200>, 0.2},
    {"poses 0.2 s early", PoseMistake::kTimeShift, true, later<-200>, -0.2},
    {"a latency of 20 ms, of a rig", PoseMistake::kTimeShift, false, later<20>, 0.02},
    {"cameras exchanged", PoseMistake::kCamerasSwapped, false,
     [](Recorded& recorded) { std::swap(recorded.sample.events[0], recorded.sample.events[1]); }},
    {"the transform between the cameras inverted", PoseMistake::kStereoInverted, false,
     [](Recorded& recorded) {
       Rigid3& T_rig_cam = recorded.rig.cameras[1].T_rig_cam;
       T_rig_cam = T_rig_cam.inverse();
     }},
    {"poses without order", PoseMistake::kUnknown, false,
     [](Recorded& recorded) {
       std::mt19937 random(1);
       std::normal_distribution<double> noise(0, 0.2);
       recorded.change([&](const StampedPose& pose) {
         const Eigen::Vector3d rotation{noise(random), noise(random), noise(random)};
         const Eigen::Vector3d translation{noise(random), noise(random), noise(random)};
         return StampedPose{pose.t_ns, {rotationBy(rotation), translation}};
       });
     }},
};

TEST(PoseCheck, FindsEachMistake) {
  for (const std::size_t cameras : {1, 2}) {
    const Recorded right = recorded(cameras);
    for (const Row& row : kRows) {
      if (cameras == 1 && !row.one_camera) continue;
      Recorded wrong = right;
      row.make(wrong);
      const std::optional<PoseFinding> finding = wrong.check();
      ASSERT_TRUE(finding) << row.name << ", cameras: " << cameras;
      EXPECT_EQ(finding->mistake, row.found) << row.name << ", cameras: " << cameras;
      if (row.found == PoseMistake::kAxes) {
        EXPECT_EQ(finding->R_body_rig, forwardLeftUp());
      }
      if (row.found == PoseMistake::kTimeShift) {
        // Neighbouring times of the search are 3 ms apart, and the events have noise.
        EXPECT_NEAR(finding->shift_s, row.shift_s, row.shift_s > 0.1 ? 0.02 : 0.007);
      }
    }
  }
}

TEST(PoseCheck, AccusesNoRightPoses) {
  const auto jittering = [](Recorded right) {
    std::mt19937 random(3);
    std::normal_distribution<double> noise;
    right.change([&](StampedPose pose) {
      const Rigid3 jitter{
          rotationBy(Eigen::Vector3d{noise(random), noise(random), noise(random)} * 0.01),
          Eigen::Vector3d{noise(random), noise(random), noise(random)} * 0.01};
      return StampedPose{pose.t_ns, pose.T_world_rig * jitter};
    });
    return right;
  };
  EdgeWorld forward;
  forward.T_world_rig = [](double t_s) {
    return Rigid3{rotationBy({0.02 * std::sin(9 * t_s), 0, 0}), {0, 0, 0.4 * t_s}};
  };
  EdgeWorld brief;
  brief.duration_s = 0.3;
  for (const std::size_t cameras : {1, 2}) {
    EXPECT_FALSE(recorded(cameras).check()) << cameras;
    EXPECT_FALSE(jittering(recorded(cameras)).check()) << cameras;
    EXPECT_FALSE(recorded(cameras, forward).check()) << cameras;
    EXPECT_FALSE(recorded(cameras, brief).check()) << cameras;
  }
}

TEST(PoseCheck, SaysNothingWithoutParallax) {
  static double speed_m_s;
  for (const double speed : {0.0, 0.01, 0.02}) {  // 5 mm to either side of a piece's middle
    speed_m_s = speed;
    EdgeWorld turning;
    turning.T_world_rig = [](double t_s) {
      return Rigid3{EdgeWorld::handHeld(t_s).rotation, {speed_m_s * t_s, 0, 0}};
    };
    Recorded inverted = recorded(2, turning);
    inverted.change([](StampedPose pose) {
      return StampedPose{pose.t_ns, pose.T_world_rig.inverse()};
    });
    EXPECT_EQ(inverted.check().has_value(), speed > 0.015) << speed;
  }
  EXPECT_FALSE(checkPoses(EdgeWorld::rig(2), {}, {}));
}

TEST(PoseCheck, CamerasOfOtherSizesAreNotExchanged) {
  Recorded uneven = recorded(2);
  CameraModel& model = uneven.rig.cameras[1].model;
  model.height -= 30;  // the first camera's events would lie outside
  auto& events = uneven.sample.events[1];
  events.erase(std::remove_if(events.begin(), events.end(),
                              [&](const Event& event) { return event.y >= model.height; }),
               events.end());
  EXPECT_FALSE(uneven.check());
}

TEST(PoseCheck, LooksThroughTheCamerasOfTheMapAlone) {
  Recorded half_mirrored = recorded(2);
  const int width = half_mirrored.rig.cameras[0].model.width;
  for (Event& event : half_mirrored.sample.events[0]) {
    event.x = static_cast<std::uint16_t>(width - 1 - event.x);
  }
  EXPECT_TRUE(half_mirrored.check());
  FusionMapperOptions options;
  options.cameras = {1};
  options.keyframe.reference_camera = 1;
  EXPECT_FALSE(checkPoses(half_mirrored.rig, {half_mirrored.sample}, options));
}

}  // namespace
}  // namespace efm
