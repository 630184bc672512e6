// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/pose_observation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CActionRobotMovement3D.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CObservationRobotPose.h>

#include <cmath>
#include <stdexcept>

#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using mrpt::obs::CActionCollection;
using mrpt::obs::CActionRobotMovement2D;
using mrpt::obs::CActionRobotMovement3D;
using mrpt::obs::CSensoryFrame;
using testing::HasSubstr;

constexpr double kQuarterTurn = 1.5707963267948966;

CActionCollection planarAction(std::int64_t t_ns, double x, double y, double turn) {
  CActionRobotMovement2D movement;
  movement.timestamp = mrptTimeFrom(t_ns);
  movement.computeFromOdometry(mrpt::poses::CPose2D(x, y, turn), {});
  return CActionCollection(movement);
}

ObservedPose poseIn(const mrpt::obs::CObservation::Ptr& observation) {
  return efm::poseIn(*observation).value();
}

TEST(DeadReckoning, ComposesMovementsInThePlane) {
  DeadReckoning reckoning;
  EXPECT_EQ(poseIn(reckoning.poseAfter(planarAction(1000, 2, 0, kQuarterTurn), {})).t_ns, 1000);
  const auto observation = reckoning.poseAfter(planarAction(2000, 3, 0, 0), {});
  EXPECT_EQ(observation->sensorLabel, "actions");
  EXPECT_EQ(poseSourceOf(*observation)->kind, PoseKind::kActions);
  const ObservedPose pose = poseIn(observation);
  EXPECT_EQ(pose.t_ns, 2000);
  EXPECT_LT((pose.T_world_body.translation - Eigen::Vector3d(2, 3, 0)).norm(), 1e-12);
  EXPECT_LT((pose.T_world_body * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(2, 4, 0)).norm(),
            1e-12);
}

TEST(DeadReckoning, ComposesMovementsInSpace) {
  DeadReckoning reckoning;
  CActionRobotMovement3D movement;
  movement.timestamp = mrptTimeFrom(1000);
  movement.poseChange.mean = mrpt::poses::CPose3D(0, 0, 2, 0, 0, kQuarterTurn);
  reckoning.poseAfter(CActionCollection(movement), {});
  const ObservedPose pose = poseIn(reckoning.poseAfter(CActionCollection(movement), {}));
  // Rolled by a quarter turn, up is where -y was.
  EXPECT_LT((pose.T_world_body.translation - Eigen::Vector3d(0, -2, 2)).norm(), 1e-12);
}

TEST(DeadReckoning, AMovementWithoutATimeHasTheTimeOfItsFrame) {
  CSensoryFrame frame;
  frame.insert(mrpt::obs::CObservationComment::Create());
  frame.getObservationByIndex(0)->timestamp = INVALID_TIMESTAMP;
  CActionCollection action = planarAction(0, 1, 0, 0);
  action.get(0)->timestamp = INVALID_TIMESTAMP;
  EXPECT_THAT(messageOf([&] { DeadReckoning().poseAfter(action, frame); }),
              HasSubstr("a movement has no time stamp"));
  frame.insert(mrpt::obs::CObservationComment::Create());
  frame.getObservationByIndex(1)->timestamp = mrptTimeFrom(5000);
  EXPECT_EQ(poseIn(DeadReckoning().poseAfter(action, frame)).t_ns, 5000);
}

TEST(DeadReckoning, ActionsWithoutMovementGiveNoPose) {
  EXPECT_EQ(DeadReckoning().poseAfter(CActionCollection(), {}), nullptr);
}

TEST(PoseObservation, OdometryIsAPoseInThePlane) {
  mrpt::obs::CObservationOdometry odometry;
  odometry.sensorLabel = "wheels";
  odometry.timestamp = mrptTimeFrom(1000);
  odometry.odometry = mrpt::poses::CPose2D(1, 2, kQuarterTurn);
  odometry.hasVelocities = true;
  EXPECT_EQ(poseSourceOf(odometry), (PoseSourceId{PoseKind::kOdometry, "wheels"}));
  const ObservedPose pose = efm::poseIn(odometry).value();
  EXPECT_LT((pose.T_world_body * Eigen::Vector3d(1, 0, 5) - Eigen::Vector3d(1, 3, 5)).norm(),
            1e-12);
  odometry.timestamp = INVALID_TIMESTAMP;
  EXPECT_THROW(efm::poseIn(odometry), std::invalid_argument);
}

TEST(PoseObservation, ItsNoiseIsTheStandardDeviationOverTheAxes) {
  mrpt::obs::CObservationRobotPose robot;
  robot.timestamp = mrptTimeFrom(1000);
  EXPECT_FALSE(efm::poseIn(robot)->noise) << "no covariance";
  robot.pose.cov(0, 0) = 1e-4;
  robot.pose.cov(1, 1) = 3e-4;
  robot.pose.cov(2, 2) = 8e-4;
  robot.pose.cov(3, 3) = robot.pose.cov(4, 4) = robot.pose.cov(5, 5) = 9e-6;
  const auto noise = efm::poseIn(robot)->noise;
  ASSERT_TRUE(noise);
  EXPECT_NEAR(noise->noise_m, 0.02, 1e-12);
  EXPECT_NEAR(noise->noise_rad, 0.003, 1e-12);
  for (const int i : {0, 3}) {  // one of both may be 0
    auto exact = robot;
    for (int axis = i; axis < i + 3; ++axis) exact.pose.cov(axis, axis) = 0;
    ASSERT_TRUE(efm::poseIn(exact)->noise);
    EXPECT_NEAR(efm::poseIn(exact)->noise->noise_m, i == 0 ? 0 : 0.02, 1e-12);
    EXPECT_NEAR(efm::poseIn(exact)->noise->noise_rad, i == 0 ? 0.003 : 0, 1e-12);
  }
  for (int i = 0; i < 6; ++i) {
    for (const double wrong : {-5.0, double(NAN), double(INFINITY)}) {
      auto invalid = robot;
      invalid.pose.cov(i, i) = wrong;
      EXPECT_FALSE(efm::poseIn(invalid)->noise) << i << ": " << wrong;
    }
  }
}

TEST(TrackerPoses, TheNewestIsThatOfTheSelectedSourceOrOfPosesInTheWorld) {
  TrackerPoses poses;
  const auto add = [&](const mrpt::obs::CObservation::Ptr& observation, std::int64_t t_ns) {
    ObservedPose observed = poseIn(observation);
    observed.t_ns = t_ns;
    poses.add(*observation, observed, observed.T_world_body);
  };
  const auto x_of = [&](const std::optional<PoseSourceId>& selected) {
    const auto* newest = poses.newest(selected);
    return newest ? newest->mean.x() : NAN;
  };
  const auto pose_at = [](double x) {
    return poseObservation({1000, Rigid3{Eigen::Quaterniond::Identity(), {x, 0, 0}}, {}}, "pose");
  };
  const auto wheels = mrpt::obs::CObservationOdometry::Create();
  wheels->sensorLabel = "wheels";
  wheels->timestamp = mrptTimeFrom(1000);
  wheels->odometry.x(7);
  const PoseSourceId odometry{PoseKind::kOdometry, "wheels"};
  constexpr std::int64_t kS = 1'000'000'000;
  add(wheels, 10 * kS);
  EXPECT_TRUE(std::isnan(x_of(std::nullopt))) << "a better one may come";
  EXPECT_EQ(x_of(odometry), 7);
  add(pose_at(1), 10 * kS);
  EXPECT_EQ(x_of(std::nullopt), 1);
  EXPECT_EQ(x_of(odometry), 7);
  add(pose_at(2), 10 * kS);
  EXPECT_EQ(x_of(std::nullopt), 2);
  for (const std::int64_t late_ns : {std::int64_t{1}, kS}) add(pose_at(3), 10 * kS - late_ns);
  EXPECT_EQ(x_of(std::nullopt), 2) << "late ones";
  add(pose_at(4), 9 * kS - 1);
  EXPECT_EQ(x_of(std::nullopt), 4) << "the clock went back";
}

TEST(PoseObservation, ReturnsThePoseAndTheRigOnTheBody) {
  const Rigid3 T_world_body{Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitX())),
                            {1, 2, 3}};
  const Rigid3 T_body_rig{Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ())),
                          {0.1, -0.2, 0.3}};
  const ObservedPose pose = poseIn(poseObservation({1000, T_world_body, T_body_rig}, "pose"));
  EXPECT_EQ(pose.t_ns, 1000);
  const Eigen::Vector3d point(4, 5, 6);
  EXPECT_LT((pose.T_world_body * point - T_world_body * point).norm(), 1e-12);
  EXPECT_LT((pose.T_body_rig * point - T_body_rig * point).norm(), 1e-12);
}

}  // namespace
}  // namespace efm
