// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "test/plugin/temporary_folder.h"
#include "tracking_stub/motion/motion.h"
#include "tracking_stub/random/random_numbers.h"

namespace efm {
namespace {

LoopMotionOptions fourSeconds() {
  LoopMotionOptions options;
  options.start_ns = 1'000'000'000;
  options.period_s = 4;
  options.radius_x_m = 2;
  options.radius_y_m = 1;
  options.height_m = 1.5;
  return options;
}

TEST(LoopMotion, LooksOutwardsAndLevelFromAnEllipse) {
  const LoopMotion loop(fourSeconds());
  const Rigid3 T_world_begin = loop.poseAt(1'000'000'000);
  EXPECT_LT((T_world_begin * Eigen::Vector3d(0, 0, 1) - Eigen::Vector3d(3, 0, 1.5)).norm(), 1e-12);
  EXPECT_LT((T_world_begin * Eigen::Vector3d(0, 1, 0) - Eigen::Vector3d(2, 0, 0.5)).norm(), 1e-12);
  // A quarter of a loop later the camera is on the +y axis, and +x is to its right.
  const Rigid3 T_world_quarter = loop.poseAt(2'000'000'000);
  EXPECT_LT((T_world_quarter * Eigen::Vector3d(0, 0, 1) - Eigen::Vector3d(0, 2, 1.5)).norm(),
            1e-12);
  EXPECT_LT((T_world_quarter * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(1, 1, 1.5)).norm(),
            1e-12);
}

TEST(LoopMotion, AHeadingOfARightAngleLooksAhead) {
  LoopMotionOptions options = fourSeconds();
  options.heading_rad = M_PI / 2;
  const Rigid3 T_world_cam = LoopMotion(options).poseAt(options.start_ns);
  EXPECT_LT((T_world_cam.rotation * Eigen::Vector3d(0, 0, 1) - Eigen::Vector3d(0, 1, 0)).norm(),
            1e-12);
}

TEST(LoopMotion, SwaysInTheFrameOfTheCamera) {
  LoopMotionOptions options = fourSeconds();
  SmoothMotionOptions sway;
  sway.T_world_center.translation = {0, 0, 0.25};  // forward
  options.sway = std::make_shared<SmoothMotion>(sway);
  EXPECT_NEAR(LoopMotion(options).poseAt(options.start_ns).translation.x(), 2.25, 1e-12);
}

TEST(LoopMotion, RejectsAPeriodOfZero) {
  LoopMotionOptions options;
  options.period_s = 0;
  EXPECT_THROW(LoopMotion{options}, std::invalid_argument);
}

TEST(SmoothMotion, MovesAlongAndAroundTheAxesOfItsCenter) {
  SmoothMotionOptions options;
  options.start_ns = 5'000'000'000;
  options.T_world_center.rotation = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ());
  options.T_world_center.translation = {1, 2, 3};
  options.translation[0] = {{0.2, 0.25, 0}};  // 0.2 at t = 1 s
  options.rotation[2] = {{0.3, 0.25, 0}};     // 0.3 at t = 1 s
  options.velocity = {0.5, 0, 0.1};
  const SmoothMotion motion(options);
  const Rigid3 T_world_rig = motion.poseAt(6'000'000'000);
  EXPECT_LT((T_world_rig.translation - Eigen::Vector3d(1, 2.7, 3.1)).norm(), 1e-12);
  EXPECT_LT(T_world_rig.rotation.angularDistance(
                Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2 + 0.3, Eigen::Vector3d::UnitZ()))),
            1e-7);
}

using Eigen::Vector3d;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::int64_t kStartNs = 1'504'645'177'500'200'147;

using Curve = std::function<Rigid3(double t_s)>;

std::vector<StampedPose> sampled(const Curve& curve, double rate_hz, double duration_s) {
  std::vector<StampedPose> poses;
  for (int i = 0; i <= static_cast<int>(duration_s * rate_hz); ++i) {
    const double t_s = i / rate_hz;
    poses.push_back({kStartNs + std::llround(t_s * 1e9), curve(t_s)});
  }
  return poses;
}

Rigid3 handHeld(double t_s) {
  Rigid3 T_world_rig;
  T_world_rig.translation = {0.3 * t_s, 0.1 * std::sin(6 * t_s), 0.05 * std::cos(9 * t_s)};
  T_world_rig.rotation = Eigen::AngleAxisd(2.5 * t_s, Vector3d(0.2, 1, 0.1).normalized()) *
                         Eigen::AngleAxisd(0.1 * std::sin(8 * t_s), Vector3d::UnitX());
  return T_world_rig;
}

/// Returns the max distance and angle between poses and a curve, without the first and last 0.25 s.
std::pair<double, double> maxError(const std::vector<StampedPose>& poses, const Curve& curve) {
  double metres = 0;
  double radians = 0;
  for (const StampedPose& pose : poses) {
    if (pose.t_ns < poses.front().t_ns + 250'000'000) continue;
    if (pose.t_ns > poses.back().t_ns - 250'000'000) continue;
    const Rigid3 truth = curve(static_cast<double>(pose.t_ns - kStartNs) * 1e-9);
    metres = std::max(metres, (pose.T_world_rig.translation - truth.translation).norm());
    radians = std::max(radians, pose.T_world_rig.rotation.angularDistance(truth.rotation));
  }
  return {metres, radians};
}

TEST(SmoothTrajectory, KeepsAMotionOfAFewHertz) {
  const auto smooth = smoothTrajectory(sampled(handHeld, 100, 4));
  ASSERT_EQ(smooth.size(), 801U);
  EXPECT_EQ(smooth[1].t_ns - smooth[0].t_ns, 5'000'000);
  const auto [metres, radians] = maxError(smooth, handHeld);
  // The error of linear interpolation over h = 10 ms is at most a h^2 / 8 = 5e-5 (a: acceleration).
  EXPECT_LT(metres, 2e-4);
  EXPECT_LT(radians, 2e-4);
}

TEST(SmoothTrajectory, CutsFrequenciesAboveTenHertz) {
  const Curve shaken = [](double t_s) {
    Rigid3 T_world_rig = handHeld(t_s);
    T_world_rig.translation.x() += 0.01 * std::sin(2 * M_PI * 20 * t_s);
    T_world_rig.rotation =
        T_world_rig.rotation *
        Eigen::AngleAxisd(0.02 * std::sin(2 * M_PI * 20 * t_s), Vector3d::UnitZ());
    return T_world_rig;
  };
  const auto [metres, radians] = maxError(smoothTrajectory(sampled(shaken, 200, 4)), handHeld);
  EXPECT_LT(metres, 0.03 * 0.01);
  EXPECT_LT(radians, 0.03 * 0.02);
}

TEST(SmoothTrajectory, RemovesSinglePosesThatJump) {
  auto poses = sampled(handHeld, 100, 4);
  RandomNumbers random(5);
  for (StampedPose& pose : poses) {  // noise of 0.1 mm, as of trackers
    pose.T_world_rig.translation += Vector3d::Constant(random.uniform(-1e-4, 1e-4));
  }
  for (const std::size_t i : {50U, 120U, 121U + 30U, 333U}) {
    poses[i].T_world_rig.translation.y() += 0.067;  // 6.7 m/s
    poses[i].T_world_rig.rotation =
        poses[i].T_world_rig.rotation * Eigen::AngleAxisd(0.1, Vector3d::UnitY());
  }
  const auto [metres, radians] = maxError(smoothTrajectory(poses), handHeld);
  EXPECT_LT(metres, 1e-3);
  EXPECT_LT(radians, 2e-3);
}

TEST(SmoothTrajectory, InterpolatesAcrossGapsAndAcceptsBothSignsOfAQuaternion) {
  auto poses = sampled(handHeld, 100, 4);
  poses.erase(poses.begin() + 200, poses.begin() + 213);  // 0.13 s
  for (std::size_t i = 0; i < poses.size(); i += 3) {
    poses[i].T_world_rig.rotation.coeffs() *= -1;
  }
  std::reverse(poses.begin(), poses.end());
  const auto [metres, radians] = maxError(smoothTrajectory(poses), handHeld);
  // The error of linear interpolation over 0.13 s is a T^2 / 8 with a = 5.4 m/s2 and 6.4 rad/s2.
  EXPECT_LT(metres, 0.013);
  EXPECT_LT(radians, 0.016);
}

TEST(SmoothTrajectory, OdometryOfTenHertzHasNoCorners) {
  const Curve drive = [](double t_s) {
    Rigid3 T_world_rig;
    T_world_rig.translation = {20 * std::sin(0.3 * t_s), 20 * std::cos(0.3 * t_s), 0};
    T_world_rig.rotation = Eigen::AngleAxisd(-0.3 * t_s, Vector3d::UnitZ());
    return T_world_rig;
  };
  const auto smooth = smoothTrajectory(sampled(drive, 10, 8));
  EXPECT_LT(maxError(smooth, drive).first, 0.01);
  // 0.3 rad/s at 6 m/s are 1.8 m/s2. Corners between lines of 0.1 s would be 36 m/s2 in 5 ms.
  for (std::size_t i = 101; i + 100 < smooth.size(); ++i) {
    const Vector3d bend = smooth[i + 1].T_world_rig.translation -
                          2 * smooth[i].T_world_rig.translation +
                          smooth[i - 1].T_world_rig.translation;
    EXPECT_LT(bend.norm() / (0.005 * 0.005), 3.6);
  }
}

TEST(SmoothTrajectory, KeepsPositionAndSpeedAtItsEnds) {
  const Curve straight = [](double t_s) {
    Rigid3 T_world_rig;
    T_world_rig.translation = {0.5 * t_s, 0, 1};
    T_world_rig.rotation = Eigen::AngleAxisd(0.8 * t_s, Vector3d::UnitY());
    return T_world_rig;
  };
  for (const StampedPose& pose : smoothTrajectory(sampled(straight, 100, 1))) {
    const Rigid3 truth = straight(static_cast<double>(pose.t_ns - kStartNs) * 1e-9);
    EXPECT_LT((pose.T_world_rig.translation - truth.translation).norm(), 1e-9);
    EXPECT_LT(pose.T_world_rig.rotation.angularDistance(truth.rotation), 1e-7);
  }
}

TEST(SmoothTrajectory, RejectsLongGapsAndTooFewPoses) {
  auto poses = sampled(handHeld, 100, 4);
  poses.erase(poses.begin() + 100, poses.begin() + 250);
  EXPECT_THAT(messageOf([&] { smoothTrajectory(poses); }),
              AllOf(HasSubstr("no pose for 1.5"), HasSubstr("1504645178.49")));
  EXPECT_THROW(smoothTrajectory({}), std::invalid_argument);
  EXPECT_THROW(smoothTrajectory({poses[0], poses[0]}), std::invalid_argument);
}

TEST(StartOfMotion, IsTheTimeWithHalfTheMeanSpeed) {
  const Curve late = [](double t_s) {
    Rigid3 T_world_rig;
    T_world_rig.translation.x() = t_s < 3 ? 0.01 * std::sin(7 * t_s) : 0.4 * (t_s - 3);
    return T_world_rig;
  };
  const double start_s =
      static_cast<double>(startOfMotion(sampled(late, 100, 10)) - kStartNs) * 1e-9;
  EXPECT_GE(start_s, 2.5);
  EXPECT_LE(start_s, 3.1);
  const Curve still = [](double) { return Rigid3(); };
  EXPECT_EQ(startOfMotion(sampled(still, 100, 10)), kStartNs);
  EXPECT_EQ(startOfMotion(sampled(late, 100, 0.1)), kStartNs);
}

TEST(SampledMotion, InterpolatesBetweenItsPosesAndRestsBeforeAndAfterThem) {
  const auto poses = sampled(handHeld, 200, 1);
  const SampledMotion motion(poses);
  EXPECT_EQ(motion.poseAt(poses[7].t_ns).translation, poses[7].T_world_rig.translation);
  const Vector3d middle =
      0.5 * (poses[7].T_world_rig.translation + poses[8].T_world_rig.translation);
  EXPECT_LT((motion.poseAt(poses[7].t_ns + 2'500'000).translation - middle).norm(), 1e-12);
  EXPECT_EQ(motion.poseAt(kStartNs - 1).translation, poses.front().T_world_rig.translation);
  EXPECT_EQ(motion.poseAt(kStartNs + 2'000'000'000).translation,
            poses.back().T_world_rig.translation);
  EXPECT_THROW(SampledMotion({poses[0], poses[1], poses[3]}), std::invalid_argument);
  EXPECT_THROW(SampledMotion({poses[0]}), std::invalid_argument);
}

}  // namespace

}  // namespace efm
