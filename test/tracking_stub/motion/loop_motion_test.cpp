// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/motion/motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

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
  // A quarter later it is on the +y axis, and +x is to the right of the camera.
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

TEST(LoopMotion, RefusesAPeriodOfZero) {
  LoopMotionOptions options;
  options.period_s = 0;
  EXPECT_THROW(LoopMotion{options}, std::invalid_argument);
}

}  // namespace
}  // namespace efm
