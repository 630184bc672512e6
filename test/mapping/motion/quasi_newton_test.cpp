// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/motion/motion_correction.h"

#include <gtest/gtest.h>

namespace efm::quasi_newton_test {
namespace {

TEST(QuasiNewton, FindsTheBottomOfRosenbrocksValley) {
  const auto valley = [](const Eigen::VectorXd& at, Eigen::VectorXd& slope) {
    const double off = at[1] - at[0] * at[0];
    slope.resize(2);
    slope << -2 * (1 - at[0]) - 400 * at[0] * off, 200 * off;
    return (1 - at[0]) * (1 - at[0]) + 100 * off * off;
  };
  QuasiNewtonOptions options;
  options.max_evaluations = 60;  // a wrong Hessian takes hundreds
  options.min_step = 1e-12;
  const Eigen::VectorXd found = minimise(valley, Eigen::Vector2d(-1.2, 1), options);
  EXPECT_NEAR(found[0], 1, 1e-5);
  EXPECT_NEAR(found[1], 1, 1e-5);
}

TEST(QuasiNewton, IsNeverWorseThanItsStartAndKeepsItsBound) {
  for (int most = 1; most <= 12; ++most) {
    int evaluations = 0;
    const auto waves = [&](const Eigen::VectorXd& at, Eigen::VectorXd& slope) {
      ++evaluations;
      slope = 9 * (9 * at.array()).cos().matrix() + 0.2 * at;
      return (9 * at.array()).sin().sum() + 0.1 * at.squaredNorm();
    };
    Eigen::VectorXd unused;
    const Eigen::Vector3d start(0.3, -0.7, 2);
    QuasiNewtonOptions options;
    options.max_evaluations = most;
    const Eigen::VectorXd found = minimise(waves, start, options);
    EXPECT_LE(evaluations, most);
    EXPECT_LE(waves(found, unused), waves(start, unused));
  }
}

TEST(QuasiNewton, StaysOnAFlatFunctionAndGoesOnDownASlope) {
  QuasiNewtonOptions options;
  options.max_evaluations = 10;
  for (const double slope : {0.0, 1.0}) {
    const auto ramp = [&](const Eigen::VectorXd& at, Eigen::VectorXd& gradient) {
      gradient = Eigen::Vector2d(slope, 0);
      return slope * at.x();
    };
    const Eigen::VectorXd found = minimise(ramp, Eigen::Vector2d(3, 4), options);
    EXPECT_EQ(found.y(), 4);
    EXPECT_LE(found.x(), 3 - 0.5 * slope) << "a tenth each time";
  }
}

}  // namespace
}  // namespace efm::quasi_newton_test
