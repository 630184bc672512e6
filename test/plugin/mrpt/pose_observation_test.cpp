// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CActionRobotMovement3D.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/poses/CPose3D.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/serialization/archiveFrom_std_vector.h>
#include <mrpt/system/datetime.h>
#include <rapidcheck/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "plugin/mrpt/pose_observation.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

// --- times --------------------------------------------------------------------------------------

TEST(MrptTime, ZeroIsTheBeginningOf1970) {
  EXPECT_EQ(mrpt::system::dateTimeToString(mrptTimeFrom(0)), "1970/01/01,00:00:00.000000");
  EXPECT_EQ(nanosecondsFrom(mrptTimeFrom(0)), 0);
}

RC_GTEST_PROP(MrptTime, IsExactForWholeTicksAndAtMostHalfATickAwayOtherwise, ()) {
  const auto t_ns =
      *rc::gen::inRange<std::int64_t>(-4'000'000'000'000'000'000, 4'000'000'000'000'000'000);
  const std::int64_t back_ns = nanosecondsFrom(mrptTimeFrom(t_ns));
  RC_ASSERT(std::abs(back_ns - t_ns) <= kTickNs / 2);
  RC_ASSERT(mrptTimeFrom(back_ns) == mrptTimeFrom(t_ns));
  RC_ASSERT(nanosecondsFrom(mrptTimeFrom(back_ns)) == back_ns);
}

TEST(MrptTime, AMissingTimeAndATimeOutOfRangeAreErrors) {
  EXPECT_THROW(nanosecondsFrom(INVALID_TIMESTAMP), std::invalid_argument);
  const auto now = mrptTimeFrom(1'700'000'000'000'000'000);
  const std::chrono::hours three_hundred_years(300 * 365 * 24);
  EXPECT_THROW(nanosecondsFrom(now + three_hundred_years), std::invalid_argument);
  for (const std::int64_t limit_ns :
       {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()}) {
    EXPECT_EQ(nanosecondsFrom(mrptTimeFrom(limit_ns)), limit_ns / 100 * 100);
  }
}

// --- poses --------------------------------------------------------------------------------------

double angleBetween(const Rigid3& a, const Rigid3& b) {
  return 2 * (a.rotation.conjugate() * b.rotation).vec().norm();
}

Eigen::Vector3d drawn(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const double x = normal(random);
  const double y = normal(random);
  return {x, y, normal(random)};
}

/// Returns a random pose.
/// @param from_vertical if not 0, the standard deviation of the pitch from 90 degrees, where MRPT's
/// angles are singular.
Rigid3 randomPose(std::mt19937& random, double from_vertical) {
  std::normal_distribution<double> normal;
  const auto draw = [&] { return normal(random); };
  Rigid3 pose;
  pose.translation = drawn(random);
  pose.rotation = Eigen::Quaterniond(draw(), draw(), draw(), draw()).normalized();
  if (from_vertical == 0) return pose;
  pose.rotation = Eigen::AngleAxisd(draw(), Eigen::Vector3d::UnitZ()) *
                  Eigen::AngleAxisd(M_PI / 2 - from_vertical * draw(), Eigen::Vector3d::UnitY()) *
                  Eigen::AngleAxisd(draw(), Eigen::Vector3d::UnitX());
  return pose;
}

TEST(MrptPoseOf, IsTheSameAfterARoundTripAndAfterAnArchive) {
  std::mt19937 random(1);
  for (int i = 0; i < 4000; ++i) {
    constexpr double kFromVertical[] = {0, 1e-3, 1e-6, 1e-9};
    const Rigid3 T_a_b = randomPose(random, kFromVertical[i % 4]);
    const mrpt::poses::CPose3D pose = mrptPoseFrom(T_a_b);
    std::vector<std::uint8_t> bytes;
    auto archive = mrpt::serialization::archiveFrom(bytes);
    archive << pose;
    mrpt::poses::CPose3D stored;
    archive >> stored;
    for (const mrpt::poses::CPose3D& same : {pose, stored}) {
      ASSERT_EQ(rigidFrom(same).translation, T_a_b.translation) << kFromVertical[i % 4];
      ASSERT_LT(angleBetween(rigidFrom(same), T_a_b), 1e-14) << kFromVertical[i % 4];
    }
  }
}

TEST(RoundedPose, IsTheSameAfterAnyConversion) {
  std::mt19937 random(2);
  for (int i = 0; i < 100000; ++i) {
    Rigid3 T_a_b = randomPose(random, i % 4 == 1 ? 1e-8 : 0);
    if (i % 4 == 2) {  // rotations of a cube, as between a body and an optical frame
      T_a_b.rotation.coeffs() = Eigen::Vector4d::Zero();
      for (int k = 0; k < 4; ++k) T_a_b.rotation.coeffs()[k] = static_cast<int>(random() % 3) - 1;
      if (T_a_b.rotation.norm() < 0.5) continue;
      T_a_b.rotation.normalize();
    }
    const Rigid3 rounded = roundedPose(T_a_b);
    ASSERT_LT(angleBetween(rounded, T_a_b), 4e-12);
    ASSERT_LT(std::abs(rounded.rotation.norm() - 1), 1e-15);
    Rigid3 negative = rounded;
    negative.rotation.coeffs() *= -1;
    const Eigen::Matrix3d R_a_b = rounded.rotation.toRotationMatrix();
    const Rigid3 identity;
    for (const Rigid3& other :
         {rounded, negative, rounded * identity, rigidFrom(mrptPoseFrom(rounded)),
          Rigid3{Eigen::Quaterniond(R_a_b), rounded.translation}}) {
      ASSERT_TRUE(isSame(roundedPose(other), rounded)) << rounded.rotation.coeffs().transpose();
    }
  }
  Rigid3 none;
  none.rotation.coeffs().setZero();
  EXPECT_FALSE(roundedPose(none).rotation.coeffs().allFinite());
}

/// Returns x, y, z, yaw, pitch and roll, in MRPT's order.
Vector6d coordinatesOf(const Rigid3& T_a_b) {
  const mrpt::poses::CPose3D pose = mrptPoseFrom(T_a_b);
  Vector6d coordinates;
  coordinates << pose.x(), pose.y(), pose.z(), pose.yaw(), pose.pitch(), pose.roll();
  return coordinates;
}

TEST(MrptPoseOf, ACovarianceIsThatOfManySmallMotions) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 20; ++trial) {
    Rigid3 T_a_b;
    T_a_b.translation = 10 * drawn(random);
    std::uniform_real_distribution<double> share(-1, 1);
    const double yaw = 2.5 * share(random);
    const double pitch = 1.2 * share(random);  // MRPT's angles are singular at 90 degrees
    T_a_b.rotation = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                     Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                     Eigen::AngleAxisd(2.5 * share(random), Eigen::Vector3d::UnitX());
    Matrix6d root;  // a motion is this matrix times standard normal numbers
    for (int column = 0; column < 6; ++column) {
      root.col(column) << 1e-3 * drawn(random), 1e-4 * drawn(random);
    }
    const Matrix6d covariance = root * root.transpose();

    constexpr int kDraws = 4000;
    const Vector6d at = coordinatesOf(T_a_b);
    Matrix6d squares = Matrix6d::Zero();
    for (int draw = 0; draw < kDraws; ++draw) {
      Vector6d unit;
      unit << drawn(random), drawn(random);
      const Vector6d motion = root * unit;
      const Eigen::Vector3d turn = motion.tail<3>();
      Rigid3 moved = T_a_b;
      moved.translation += motion.head<3>();
      moved.rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * T_a_b.rotation;
      const Vector6d change = coordinatesOf(moved) - at;
      squares += change * change.transpose();
    }
    const auto estimate = mrptPoseFrom(T_a_b, covariance);
    const Matrix6d found = estimate.cov.asEigen();
    EXPECT_LT((rigidFrom(estimate.mean).translation - T_a_b.translation).norm(), 1e-12);
    EXPECT_LT(angleBetween(rigidFrom(estimate.mean), T_a_b), 1e-12);
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) {
        // The mean of 4000 products has an error of 1.6 to 2.2 % of both deviations: 5 times that.
        EXPECT_NEAR(squares(i, j) / kDraws, found(i, j),
                    0.11 * std::sqrt(found(i, i) * found(j, j)))
            << "pitch " << pitch << ", element " << i << ", " << j;
      }
    }
  }
}

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

PoseSample poseIn(const mrpt::obs::CObservation::Ptr& observation) {
  return efm::poseIn(*observation).value();
}

TEST(DeadReckoning, ComposesMovementsInThePlane) {
  DeadReckoning reckoning;
  EXPECT_EQ(poseIn(reckoning.poseAfter(planarAction(1000, 2, 0, kQuarterTurn), {})).t_ns, 1000);
  const auto observation = reckoning.poseAfter(planarAction(2000, 3, 0, 0), {});
  EXPECT_EQ(observation->sensorLabel, "actions");
  EXPECT_EQ(poseSourceOf(*observation)->kind, PoseKind::kActions);
  const PoseSample pose = poseIn(observation);
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
  const PoseSample pose = poseIn(reckoning.poseAfter(CActionCollection(movement), {}));
  // After a roll of 90 degrees, up is along the former -y.
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

TEST(PoseObservation, OdometryIsAPoseInThePlane) {
  mrpt::obs::CObservationOdometry odometry;
  odometry.sensorLabel = "wheels";
  odometry.timestamp = mrptTimeFrom(1000);
  odometry.odometry = mrpt::poses::CPose2D(1, 2, kQuarterTurn);
  odometry.hasVelocities = true;
  EXPECT_EQ(poseSourceOf(odometry), (PoseSourceId{PoseKind::kOdometry, "wheels"}));
  const PoseSample pose = efm::poseIn(odometry).value();
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
  for (const int i : {0, 3}) {  // one of both deviations may be 0
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
    PoseSample observed = poseIn(observation);
    observed.t_ns = t_ns;
    poses.add(*observation, observed);
  };
  const auto x_of = [&](const std::optional<PoseSourceId>& selected) {
    const auto* newest = poses.newest(selected);
    return newest ? newest->mean.x() : NAN;
  };
  const auto pose_at = [](double x) {
    return poseObservation(
        {{PoseKind::kPose, "pose"}, 1000, {Eigen::Quaterniond::Identity(), {x, 0, 0}}, {}});
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
  const PoseSample pose =
      poseIn(poseObservation({{PoseKind::kPose, "pose"}, 1000, T_world_body, T_body_rig}));
  EXPECT_EQ(pose.t_ns, 1000);
  const Eigen::Vector3d point(4, 5, 6);
  EXPECT_LT((pose.T_world_body * point - T_world_body * point).norm(), 1e-11)
      << "rotations are rounded to 1e-12";
  EXPECT_LT((pose.T_body_rig * point - T_body_rig * point).norm(), 1e-11)
      << "rotations are rounded to 1e-12";
}

}  // namespace

}  // namespace efm
