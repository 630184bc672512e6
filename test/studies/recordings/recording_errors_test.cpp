// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/recordings/recording_errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "tracking_stub/motion/smooth_motion.h"

namespace efm::studies {
namespace {

constexpr std::int64_t kStartNs = 1'000'000'000;

/// A rig that moves to the right at 0.5 m/s for 2 s.
Recording straightOn() {
  SmoothMotionOptions motion;
  motion.start_ns = kStartNs;
  motion.velocity = {0.5, 0, 0};
  Recording recording;
  recording.simulation.motion = std::make_shared<SmoothMotion>(motion);
  recording.simulation.start_ns = kStartNs;
  recording.simulation.duration_ns = 2'000'000'000;
  recording.events = {{}, {{kStartNs, 3, 4, true}}};
  return recording;
}

TEST(PoseErrors, OfZeroLeaveThePosesWhereTheyAre) {
  const Recording recording = straightOn();
  const Recording same = withPoseErrors(recording, {});
  EXPECT_EQ(same.trajectory.poses().size(), 201U);
  for (const StampedPose& pose : same.trajectory.poses()) {
    const Rigid3 T_world_rig = recording.simulation.motion->poseAt(pose.t_ns);
    EXPECT_LT((pose.T_world_rig.translation - T_world_rig.translation).norm(), 1e-12);
  }
}

TEST(PoseErrors, LatePosesSayWhereTheRigWasBefore) {
  PoseErrors errors;
  errors.late_ns = 20'000'000;
  const auto pose =
      withPoseErrors(straightOn(), errors).trajectory.poseAt(kStartNs + 1'000'000'000);
  ASSERT_TRUE(pose);
  EXPECT_NEAR(pose->translation.x(), 0.5 * 0.98, 1e-9);
}

TEST(PoseErrors, DriftRunsAwayAndBendsTheWay) {
  PoseErrors errors;
  errors.drift_m_s = 0.01;
  EXPECT_NEAR(
      withPoseErrors(straightOn(), errors).trajectory.poses().back().T_world_rig.translation.y(),
      0.02, 1e-9);
  errors = {};
  errors.drift_rad_s = 0.02;
  const Rigid3 T_world_rig =
      withPoseErrors(straightOn(), errors).trajectory.poses().back().T_world_rig;
  EXPECT_NEAR(T_world_rig.rotation.angularDistance(Eigen::Quaterniond::Identity()),
              0.04 * std::sqrt(3.0), 1e-9);
  // The way bends by half the turn at its end.
  EXPECT_NEAR(T_world_rig.translation.y(), 0.02, 1e-3);
  EXPECT_NEAR(T_world_rig.translation.norm(), 1, 1e-2);
}

TEST(PoseErrors, NoiseHasTheDeviationAskedFor) {
  PoseErrors errors;
  errors.period_ns = 100'000;
  errors.noise_m = 0.01;
  const Recording recording = straightOn();
  double sum = 0;
  const Recording noisy = withPoseErrors(recording, errors);
  for (const StampedPose& pose : noisy.trajectory.poses()) {
    const Rigid3 T_world_rig = recording.simulation.motion->poseAt(pose.t_ns);
    sum += (pose.T_world_rig.translation - T_world_rig.translation).squaredNorm() / 3;
  }
  EXPECT_NEAR(std::sqrt(sum / static_cast<double>(noisy.trajectory.poses().size())), 0.01, 2e-4);
}

TEST(PoseErrors, ALateCameraIsLateAlone) {
  const Recording late = withLateCamera(straightOn(), 1, 5'000'000);
  EXPECT_EQ(late.events[1][0].t_ns, kStartNs + 5'000'000);
}

}  // namespace
}  // namespace efm::studies
