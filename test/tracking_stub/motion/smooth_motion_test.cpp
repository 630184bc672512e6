// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/motion/motion.h"

#include <gtest/gtest.h>

namespace efm {
namespace {

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

}  // namespace
}  // namespace efm
