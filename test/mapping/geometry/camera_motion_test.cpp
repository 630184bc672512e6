// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/trajectory.h"

#include <gtest/gtest.h>

#include "test/mapping/keyframes/random_scene.h"

namespace efm::camera_motion_test {
namespace {

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
}  // namespace efm::camera_motion_test
