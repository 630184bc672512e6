// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
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

namespace efm {
namespace {

// --- pose_observation.h
// -------------------------------------------------------------------------------

TEST(MrptTime, ZeroIsTheBeginningOf1970) {
  EXPECT_EQ(mrpt::system::dateTimeToString(mrptTimeFrom(0)), "1970/01/01,00:00:00.000000");
  EXPECT_EQ(nanosecondsFrom(mrptTimeFrom(0)), 0);
}

RC_GTEST_PROP(MrptTime, IsExactForWholeTicksAndAtMostHalfATickAwayOtherwise, ()) {
  const auto t_ns =
      *rc::gen::inRange<std::int64_t>(-4'000'000'000'000'000'000, 4'000'000'000'000'000'000);
  const std::int64_t back_ns = nanosecondsFrom(mrptTimeFrom(t_ns));
  RC_ASSERT(std::abs(back_ns - t_ns) <= kMrptTickNs / 2);
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

// --- pose_observation.h
// -------------------------------------------------------------------------------

double angleBetween(const Rigid3& a, const Rigid3& b) {
  return 2 * (a.rotation.conjugate() * b.rotation).vec().norm();
}

/// A random pose.
/// @param from_vertical if not 0, the standard deviation of the pitch from 90 degrees, where MRPT's
/// angles are singular.
Rigid3 randomPose(std::mt19937& random, double from_vertical) {
  std::normal_distribution<double> normal;
  const auto draw = [&] { return normal(random); };
  Rigid3 pose;
  pose.translation = {draw(), draw(), draw()};
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

Eigen::Vector3d drawn(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const double x = normal(random);
  const double y = normal(random);
  return {x, y, normal(random)};
}

/// x, y, z, yaw, pitch and roll, as MRPT has them.
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
    Matrix6d root;  // motions are this times standard normal numbers
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
        // A mean of 4000 products is known to 1.6 % of both deviations: five times that.
        EXPECT_NEAR(squares(i, j) / kDraws, found(i, j),
                    0.11 * std::sqrt(found(i, i) * found(j, j)))
            << "pitch " << pitch << ", element " << i << ", " << j;
      }
    }
  }
}

}  // namespace
}  // namespace efm
