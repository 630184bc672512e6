// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/dead_reckoning.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CActionRobotMovement3D.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CObservationRobotPose.h>

#include <stdexcept>

#include "plugin/mrpt/mrpt_time.h"
#include "plugin/mrpt/pose_observation.h"

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
  try {
    DeadReckoning().poseAfter(action, frame);
    ADD_FAILURE() << "no error";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("a movement has no time stamp"));
  }
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
