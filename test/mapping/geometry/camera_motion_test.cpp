// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/camera_motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "test/mapping/keyframes/random_scene.h"

namespace efm::camera_motion_test {
namespace {

using test::RandomScene;

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
constexpr std::int64_t kLength_ns = 10'000'000;

/// The maximum difference to the product of the transforms, metres and 1.
double differenceToChain(const TrajectorySegment& segment, const Rigid3& T_ref_world,
                         const Rigid3& T_rig_cam) {
  const CameraMotion motion(segment, T_ref_world, T_rig_cam);
  double largest = 0;
  for (std::int64_t t_ns = segment.first.t_ns; t_ns <= segment.last.t_ns; t_ns += 1'234'567) {
    const Rigid3 expected = T_ref_world * segment.poseAt(t_ns) * T_rig_cam;
    const Rigid3 actual = motion.poseAt(t_ns);
    EXPECT_NEAR(actual.rotation.norm(), 1, 1e-15);
    const Eigen::Matrix3d rotation =
        actual.rotation.toRotationMatrix() - expected.rotation.toRotationMatrix();
    const Eigen::Vector3d translation = actual.translation - expected.translation;
    largest =
        std::max({largest, rotation.cwiseAbs().maxCoeff(), translation.cwiseAbs().maxCoeff()});
  }
  return largest;
}

TEST(CameraMotion, IsTheProductOfTheTransforms) {
  RandomScene random(1);
  for (const double turn_rad : {0.0, 1e-8, 1e-3, 0.3, 3.0}) {
    for (int trial = 0; trial < 20; ++trial) {
      const Rigid3 T_world_rig = random.pose(3, 3);
      const TrajectorySegment segment{
          {kStart_ns, T_world_rig},
          {kStart_ns + kLength_ns, T_world_rig * random.pose(0.1, turn_rad)}};
      EXPECT_LT(differenceToChain(segment, random.pose(3, 3), random.pose(0.5, 3)), 1e-12)
          << turn_rad;
    }
  }
}

TEST(CameraMotion, RotatesAlongTheShorterArcForAnySignsOfTheQuaternions) {
  RandomScene random(2);
  const Rigid3 T_world_rig = random.pose(1, 1);
  TrajectorySegment segment{{kStart_ns, T_world_rig},
                            {kStart_ns + kLength_ns, T_world_rig * random.pose(0.1, 0.5)}};
  segment.last.T_world_rig.rotation.coeffs() *= -1;
  EXPECT_LT(differenceToChain(segment, random.pose(1, 1), random.pose(0.1, 1)), 1e-12);
}

TEST(CameraMotion, OfASinglePoseIsThatPose) {
  RandomScene random(3);
  const StampedPose pose{kStart_ns, random.pose(1, 1)};
  EXPECT_LT(differenceToChain({pose, pose}, random.pose(1, 1), random.pose(0.1, 1)), 1e-12);
}

}  // namespace
}  // namespace efm::camera_motion_test
