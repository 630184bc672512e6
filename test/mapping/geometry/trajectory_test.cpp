// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <sstream>
#include <stdexcept>

#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/geometry/trajectory.h"
#include "test/mapping/keyframes/random_scene.h"
#include "test/plugin/temporary_folder.h"

namespace efm::trajectory_test {
namespace {

StampedPose at(std::int64_t t_ns, double x, double yaw_rad = 0) {
  return {t_ns, {rotationBy({0, 0, yaw_rad}), {x, 0, 0}}};
}

Trajectory trajectoryOf(const std::vector<StampedPose>& poses, double max_gap_s = 0.25) {
  Trajectory trajectory({max_gap_s});
  for (const StampedPose& pose : poses) EXPECT_TRUE(trajectory.add(pose));
  return trajectory;
}

TEST(Trajectory, BetweenPosesInAnyOrderPositionIsLinearAndRotationTheShorterArc) {
  StampedPose last = at(100'000'000, 3.0, 0.6);
  last.T_world_rig.rotation.coeffs() *= -3;  // of any length and sign
  const Trajectory trajectory = trajectoryOf({last, at(200'000'000, 9), at(0, 1.0, 0.2)});
  const auto T_world_rig = trajectory.poseAt(25'000'000);
  ASSERT_TRUE(T_world_rig);
  EXPECT_NEAR(T_world_rig->translation.x(), 1.5, 1e-12);
  EXPECT_NEAR(T_world_rig->rotation.norm(), 1, 1e-12);
  EXPECT_NEAR(std::abs(T_world_rig->rotation.z()), std::sin(0.15), 1e-12);
}

TEST(Trajectory, HasNoPoseOutsideItAndInGapsButAtTheirEnds) {
  // A gap that equals the limit is bridged.
  const Trajectory trajectory =
      trajectoryOf({at(10, 1), at(250'000'010, 2), at(500'000'011, 3), at(900'000'000, 4)}, 0.25);
  EXPECT_FALSE(trajectory.poseAt(9));
  EXPECT_EQ(trajectory.poseAt(10)->translation.x(), 1);
  EXPECT_TRUE(trajectory.poseAt(100'000'000));
  EXPECT_EQ(trajectory.poseAt(250'000'010)->translation.x(), 2);
  EXPECT_FALSE(trajectory.poseAt(250'000'011));
  EXPECT_FALSE(trajectory.poseAt(500'000'010));
  EXPECT_EQ(trajectory.poseAt(500'000'011)->translation.x(), 3);
  EXPECT_EQ(trajectory.poseAt(900'000'000)->translation.x(), 4);
  EXPECT_FALSE(trajectory.poseAt(900'000'001));
  EXPECT_FALSE(Trajectory().poseAt(0));
}

TEST(Trajectory, OfTwoPosesAtTheSameTimeTheFirstStays) {
  Trajectory trajectory = trajectoryOf({at(5, 1), at(9, 3)});
  EXPECT_FALSE(trajectory.add(at(5, 2)));
  EXPECT_FALSE(trajectory.add(at(9, 2)));
  EXPECT_EQ(trajectory.poseAt(5)->translation.x(), 1);
  EXPECT_EQ(trajectory.poseAt(9)->translation.x(), 3);
}

TEST(Trajectory, InvalidPosesAreRejected) {
  const auto with = [](const std::function<void(StampedPose&)>& change) {
    StampedPose pose = at(0, 0);
    change(pose);
    return pose;
  };
  Trajectory trajectory;
  for (const StampedPose& wrong : {with([](auto& p) { p.T_world_rig.translation.z() = NAN; }),
                                   with([](auto& p) { p.T_world_rig.rotation.x() = NAN; }),
                                   with([](auto& p) { p.T_world_rig.rotation.coeffs() *= 0.9e-6; }),
                                   with([](auto& p) { p.t_ns = kEndOfTimeNs + 1; }),
                                   with([](auto& p) { p.t_ns = -kEndOfTimeNs - 1; })}) {
    EXPECT_THROW(trajectory.add(wrong), std::invalid_argument) << wrong.t_ns;
  }
  EXPECT_TRUE(trajectory.empty());
  EXPECT_TRUE(trajectory.add(with([](auto& p) { p.T_world_rig.rotation.coeffs() *= 1.1e-6; })));
  EXPECT_TRUE(trajectory.add(at(kEndOfTimeNs, 0)));
  EXPECT_TRUE(trajectory.add(at(-kEndOfTimeNs, 0)));
}

TEST(Trajectory, ForgettingKeepsWhatLaterTimesNeed) {
  for (const std::int64_t from_ns : {90'500, 90'000}) {
    Trajectory trajectory;
    for (int i = 0; i <= 100; ++i) trajectory.add(at(i * 1000, i));
    trajectory.forgetBefore(from_ns);
    EXPECT_EQ(trajectory.poses().front().t_ns, 90'000);
    EXPECT_EQ(trajectory.poses().size(), 11U);
    trajectory.forgetBefore(80'000);
    EXPECT_EQ(trajectory.poses().size(), 11U);
  }
}

TEST(Trajectory, APartThatIsMovedHasThePosesAroundItsTimesAndTheSameGaps) {
  const Trajectory trajectory =
      trajectoryOf({at(10, 1), at(20, 2), at(30, 3), at(40, 4), at(60, 6)}, 1e-8);
  const struct {
    std::int64_t from_ns, to_ns, first_ns, last_ns;
  } cases[] = {{25, 35, 20, 40}, {20, 40, 20, 40}, {0, 15, 10, 20}, {39, 99, 30, 60}};
  for (const auto& c : cases) {
    const Trajectory moved = trajectory.moved(c.from_ns, c.to_ns, [](const StampedPose& pose) {
      return Rigid3{{}, 2 * pose.T_world_rig.translation};
    });
    ASSERT_FALSE(moved.empty());
    EXPECT_EQ(moved.poses().front().t_ns, c.first_ns);
    EXPECT_EQ(moved.poses().back().t_ns, c.last_ns);
    for (const StampedPose& pose : moved.poses()) {
      EXPECT_EQ(pose.T_world_rig.translation.x(), 0.2 * static_cast<double>(pose.t_ns));
    }
    EXPECT_FALSE(moved.poseAt(50)) << "a gap";
  }
}

/// A query with a cursor at any position gives the same answer as a search.
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

TEST(Trajectory, AtARecordedTimeTheSegmentBeginsThere) {
  const Trajectory trajectory = trajectoryOf({at(10, 1), at(20, 2), at(30, 3)});
  for (const std::size_t left_at : {0, 1, 2, 9}) {
    for (const std::int64_t t_ns : {10, 20, 30}) {
      std::size_t cursor = left_at;
      EXPECT_EQ(trajectory.segmentAt(t_ns, cursor)->first.t_ns, t_ns);
      EXPECT_EQ(cursor, static_cast<std::size_t>(t_ns / 10 - 1));
    }
  }
}

TEST(Rigid3, TransformsAsItsMatrixDoes) {
  test::RandomScene random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Rigid3 T_a_b = random.pose(2, 3);
    const Rigid3 T_b_c = random.pose(2, 3);
    const auto matrixOf = [](const Rigid3& pose) {
      Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
      matrix.topLeftCorner<3, 3>() = pose.rotation.toRotationMatrix();
      matrix.topRightCorner<3, 1>() = pose.translation;
      return matrix;
    };
    const Eigen::Matrix4d T_a_c = matrixOf(T_a_b) * matrixOf(T_b_c);
    EXPECT_TRUE(matrixOf(T_a_b * T_b_c).isApprox(T_a_c, 1e-12));
    EXPECT_TRUE(matrixOf(T_a_b.inverse()).isApprox(matrixOf(T_a_b).inverse(), 1e-12));
    const Eigen::Vector3d point(1, -2, 3);
    EXPECT_LT((T_a_b * point - (matrixOf(T_a_b) * point.homogeneous()).head<3>()).norm(), 1e-12);
  }
  EXPECT_TRUE(rotationBy({0, 0, 0}).isApprox(Eigen::Quaterniond::Identity()));
  EXPECT_TRUE(rotationBy({0, -0.4, 0})
                  .isApprox(Eigen::Quaterniond(Eigen::AngleAxisd(-0.4, Eigen::Vector3d::UnitY()))));
}

TEST(RoundedRotation, IsTheNearestOfMatricesAndQuaternionsThatAreRounded) {
  const Rigid3 exact{rotationBy({0.3, -0.5, 0.2}), {1, 2, 3}};
  const Eigen::Matrix3d R = exact.rotation.toRotationMatrix();
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  T.topLeftCorner<3, 3>() = (R * 1000).array().round() / 1000;
  T.topRightCorner<3, 1>() = exact.translation;
  const auto near = transformNear(T);
  ASSERT_TRUE(near);
  EXPECT_NEAR(near->rotation.norm(), 1, 1e-12);
  EXPECT_LT(near->rotation.angularDistance(exact.rotation), 1e-3);  // entries have three digits
  EXPECT_EQ(near->translation, exact.translation);
  EXPECT_TRUE(rotationNear(Eigen::Matrix3d(R * 1.0004)));  // R R^T is off by 8e-4
  EXPECT_FALSE(rotationNear(Eigen::Matrix3d(R * 1.0006)));
  EXPECT_FALSE(rotationNear(Eigen::Matrix3d(-R)));
  EXPECT_FALSE(rotationNear(Eigen::Matrix3d(R * NAN)));
  for (const double off : {1.1e-3, -1.1e-3, double{NAN}}) {
    for (const int column : {0, 3}) {
      Eigen::Matrix4d wrong = T;
      wrong(3, column) += off;
      EXPECT_FALSE(transformNear(wrong)) << off;
      wrong(3, column) = T(3, column) + 0.8 * off;
      EXPECT_EQ(transformNear(wrong).has_value(), !std::isnan(off)) << off;
    }
  }
  for (const double length : {0.991, 1.009, 0.989, 1.011, double{NAN}}) {
    const auto rotation = rotationNear(Eigen::Quaterniond(length * exact.rotation.coeffs()));
    EXPECT_EQ(rotation.has_value(), std::abs(length - 1) < 0.01) << length;
    if (!rotation) continue;
    EXPECT_TRUE(rotation->isApprox(exact.rotation, 1e-12));
  }
}

TEST(CameraMotion, IsTheProductOfTheTransformsAlongTheShorterArc) {
  constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
  test::RandomScene random(1);
  for (const double turn_rad : {0.0, 1e-8, 1e-3, 0.3, 3.0}) {
    for (int trial = 0; trial < 20; ++trial) {
      const Rigid3 T_world_rig = random.pose(3, 3);
      const Rigid3 T_ref_world = random.pose(3, 3);
      const Rigid3 T_rig_cam = random.pose(0.5, 3);
      const bool one_pose = trial == 0;
      TrajectorySegment segment{{kStart_ns, T_world_rig}, {kStart_ns, T_world_rig}};
      if (!one_pose) {
        segment.last = {kStart_ns + 10'000'000, T_world_rig * random.pose(0.1, turn_rad)};
      }
      if (trial % 2 == 1) segment.last.T_world_rig.rotation.coeffs() *= -1;  // the same rotation
      const CameraMotion motion(segment, T_ref_world, T_rig_cam);
      for (std::int64_t t_ns = kStart_ns; t_ns <= segment.last.t_ns; t_ns += 1'234'567) {
        const Rigid3 expected = T_ref_world * segment.poseAt(t_ns) * T_rig_cam;
        const Rigid3 actual = motion.poseAt(t_ns);
        EXPECT_NEAR(actual.rotation.norm(), 1, 1e-15);
        EXPECT_TRUE(actual.rotation.toRotationMatrix().isApprox(
            expected.rotation.toRotationMatrix(), 1e-12))
            << turn_rad;
        EXPECT_LT((actual.translation - expected.translation).norm(), 1e-12) << turn_rad;
      }
    }
  }
}

}  // namespace

}  // namespace efm::trajectory_test
