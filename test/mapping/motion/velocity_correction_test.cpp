// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/motion/event_contrast.h"

#include <gtest/gtest.h>

#include "test/mapping/keyframes/random_scene.h"

namespace efm::velocity_correction_test {
namespace {

using test::RandomRecording;

constexpr std::int64_t kMs = 1'000'000;

void expectNear(const Rigid3& a, const Rigid3& b, double tolerance) {
  EXPECT_LT((a.translation - b.translation).norm(), tolerance);
  EXPECT_LT((a.rotation.conjugate() * b.rotation).vec().norm(), tolerance);
}

TEST(VelocityCorrection, ADisplacementIsManySmallOnes) {
  const VelocityCorrection correction{{0.3, -0.2, 0.5}, {-1.2, 0.4, 0.7}};
  constexpr int kSteps = 1000;
  Rigid3 T_rig_true;
  for (int i = 0; i < kSteps; ++i) {
    T_rig_true = T_rig_true * correction.displacement(0.8 / kSteps);
  }
  expectNear(correction.displacement(0.8), T_rig_true, 1e-10);
  expectNear(correction.displacement(-0.8), T_rig_true.inverse(), 1e-10);
}

TEST(VelocityCorrection, SmallRotationsAreAsExactAsLargeOnes) {
  const Eigen::Vector3d linear_m_s(1, 2, 3);
  for (const double rate : {0.999e-4, 1.001e-4}) {  // either side of where the series ends
    const Rigid3 T_rig_true = VelocityCorrection{linear_m_s, {rate, 0, 0}}.displacement(1);
    EXPECT_NEAR(T_rig_true.rotation.x(), std::sin(rate / 2), 1e-18);
    EXPECT_NEAR(T_rig_true.translation.y(), 2 - 3 * rate / 2, 1e-8);
  }
}

TEST(VelocityCorrection, PosesMoveByTheDisplacementSinceTheReference) {
  const RandomRecording recording(2, 1, 10);
  const Window window = RandomRecording::kWindow;
  const VelocityCorrection correction{{0.05, -0.03, 0.02}, {0.1, -0.05, 0.08}};
  const Trajectory corrected = correctedTrajectory(recording.trajectory, window, correction);
  EXPECT_TRUE(isSame(corrected.poseAt(window.t_ref_ns).value(),
                     recording.trajectory.poseAt(window.t_ref_ns).value()));
  for (std::int64_t t_ns = window.t0_ns; t_ns < window.t1_ns; t_ns += 3 * kMs) {
    const double since_s = 1e-9 * static_cast<double>(t_ns - window.t_ref_ns);
    // Between poses 5 ms apart, rotated by at most 0.01, the line differs a little from the screw.
    expectNear(corrected.poseAt(t_ns).value(),
               recording.trajectory.poseAt(t_ns).value() * correction.displacement(since_s), 2e-6);
  }
}

}  // namespace
}  // namespace efm::velocity_correction_test
