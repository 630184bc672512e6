// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/trajectory.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

namespace efm::trajectory_test {
namespace {

StampedPose at(std::int64_t t_ns, double x, double yaw_rad = 0) {
  return {t_ns,
          {Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ())), {x, 0, 0}}};
}

Trajectory trajectoryOf(const std::vector<StampedPose>& poses, double max_gap_s = 0.25) {
  Trajectory trajectory({max_gap_s});
  for (const StampedPose& pose : poses) trajectory.add(pose);
  return trajectory;
}

TEST(Trajectory, PositionIsLinearAndRotationSlerpsBetweenPoses) {
  const Trajectory trajectory = trajectoryOf({at(0, 1.0, 0.2), at(100'000'000, 3.0, 0.6)});
  const auto T_world_rig = trajectory.poseAt(25'000'000);
  ASSERT_TRUE(T_world_rig);
  EXPECT_NEAR(T_world_rig->translation.x(), 1.5, 1e-12);
  EXPECT_NEAR(Eigen::AngleAxisd(T_world_rig->rotation).angle(), 0.3, 1e-12);
}

TEST(Trajectory, RotationTakesTheShorterArcForAnySignOfTheQuaternion) {
  StampedPose flipped = at(100, 0, 0.4);
  flipped.T_world_rig.rotation.coeffs() *= -1;
  const auto T_world_rig = trajectoryOf({at(0, 0, 0.2), flipped}).poseAt(50);
  ASSERT_TRUE(T_world_rig);
  EXPECT_NEAR(T_world_rig->rotation.angularDistance(at(0, 0, 0.3).T_world_rig.rotation), 0, 1e-7);
}

TEST(Trajectory, NeverExtrapolates) {
  const Trajectory trajectory = trajectoryOf({at(100, 0), at(200, 1)});
  EXPECT_FALSE(trajectory.poseAt(99));
  EXPECT_TRUE(trajectory.poseAt(100));
  EXPECT_TRUE(trajectory.poseAt(200));
  EXPECT_FALSE(trajectory.poseAt(201));
  EXPECT_FALSE(Trajectory().poseAt(0));
}

TEST(Trajectory, AGapHasNoPoseButItsEndsDo) {
  const Trajectory trajectory =
      trajectoryOf({at(0, 0), at(250'000'000, 1), at(500'000'001, 2)}, 0.25);
  EXPECT_TRUE(trajectory.poseAt(100'000'000)) << "a gap of exactly the limit is bridged";
  EXPECT_FALSE(trajectory.poseAt(250'000'001));
  EXPECT_FALSE(trajectory.poseAt(500'000'000));
  ASSERT_TRUE(trajectory.poseAt(500'000'001));
  EXPECT_EQ(trajectory.poseAt(500'000'001)->translation.x(), 2);
  EXPECT_EQ(trajectory.poseAt(250'000'000)->translation.x(), 1);
}

TEST(Trajectory, ASinglePoseHoldsAtItsOwnTimeOnly) {
  const Trajectory trajectory = trajectoryOf({at(1'700'000'000'000'000'001, 4)});
  EXPECT_FALSE(trajectory.poseAt(1'700'000'000'000'000'000));
  ASSERT_TRUE(trajectory.poseAt(1'700'000'000'000'000'001));
  EXPECT_FALSE(trajectory.poseAt(1'700'000'000'000'000'002));
}

TEST(Trajectory, OfTwoPosesAtTheSameTimeTheFirstStays) {
  Trajectory trajectory;
  EXPECT_TRUE(trajectory.add(at(5, 1)));
  EXPECT_FALSE(trajectory.add(at(5, 2)));
  EXPECT_EQ(trajectory.poseAt(5)->translation.x(), 1);
}

TEST(Trajectory, PosesMayComeInAnyOrder) {
  const Trajectory trajectory = trajectoryOf({at(20, 2), at(0, 0), at(10, 1)});
  EXPECT_NEAR(trajectory.poseAt(15)->translation.x(), 1.5, 1e-12);
}

TEST(Trajectory, InvalidPosesAreRefused) {
  Trajectory trajectory;
  EXPECT_THROW(trajectory.add(at(0, std::numeric_limits<double>::quiet_NaN())),
               std::invalid_argument);
  StampedPose no_rotation;
  no_rotation.T_world_rig.rotation.coeffs().setZero();
  EXPECT_THROW(trajectory.add(no_rotation), std::invalid_argument);
}

TEST(Trajectory, ForgettingKeepsWhatLaterTimesNeed) {
  Trajectory trajectory;
  for (int i = 0; i <= 100; ++i) trajectory.add(at(i * 1000, i));
  trajectory.forgetBefore(90'500);
  EXPECT_LT(trajectory.poses().size(), 20U);
  EXPECT_NEAR(trajectory.poseAt(90'500)->translation.x(), 90.5, 1e-9);
}

/// A query through a cursor that was left anywhere answers as a search does.
RC_GTEST_PROP(Trajectory, TheCursorNeverChangesTheAnswer, (const std::set<std::uint16_t>& times)) {
  Trajectory trajectory({1e-6});  // gaps beyond 1000 ns
  for (const auto t : times) trajectory.add(at(t, t));
  std::size_t cursor = *rc::gen::inRange<std::size_t>(0, 200);
  for (int i = 0; i < 50; ++i) {
    const auto t = *rc::gen::inRange<std::int64_t>(-10, 66'000);
    const auto segment = trajectory.segmentAt(t, cursor);
    const auto T_world_rig = trajectory.poseAt(t);
    RC_ASSERT(segment.has_value() == T_world_rig.has_value());
    if (!segment) continue;
    RC_ASSERT(segment->first.t_ns <= t && t <= segment->last.t_ns);
    RC_ASSERT(std::abs(segment->poseAt(t).translation.x() - static_cast<double>(t)) < 1e-9);
  }
}

}  // namespace
}  // namespace efm::trajectory_test
