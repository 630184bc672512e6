// SPDX-License-Identifier: BSD-3-Clause
// Tests a tracker that is wrong within the window, on the simulated desk.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "mapping/depth/peak_fit.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "mapping/motion/event_contrast.h"
#include "test/integration/simulated_recording.h"
#include "test/mapping/depth/same_image.h"

namespace efm {
namespace {

class MotionCorrectionOnTheDesk : public ::testing::Test {
 protected:
  static const test::SimulatedRecording& desk() { return test::SimulatedRecording::desk(); }

  static Window window() {
    const std::int64_t start_ns = desk().simulation().start_ns;
    return {start_ns, start_ns + 200'000'000, start_ns + 100'000'000};
  }

  static Trajectory truth() {
    Trajectory trajectory;
    for (const StampedPose& pose : desk().poses()) trajectory.add(pose);
    return trajectory;
  }

  static KeyframeDepthMap map(const Trajectory& trajectory, bool correct_motion) {
    KeyframeMapperOptions options;
    options.planes = {0.55, 5.0, 100, PlaneSpacing::kInverse};
    options.motion.correct_motion = correct_motion;
    options.motion.motion_rounds = 3;
    KeyframeMapper mapper(desk().simulation().rig, {0, 1}, options);
    std::vector<EventSpan> events;
    for (const std::vector<Event>& camera : desk().events()) {
      const auto end = std::find_if(camera.begin(), camera.end(), [](const Event& event) {
        return event.t_ns >= window().t1_ns;
      });
      events.emplace_back(camera.data(), camera.data() + (end - camera.begin()));
    }
    return mapper.map(window(), events, trajectory).value();
  }

  /// Returns the median of the relative depth errors.
  static double error(const KeyframeDepthMap& keyframe) {
    std::vector<double> errors;
    for (const DepthPair& pair : desk().pairs(keyframe)) {
      errors.push_back(std::abs(pair.estimate_m / pair.truth_m - 1));
    }
    return upperMedian(errors);
  }
};

TEST_F(MotionCorrectionOnTheDesk, AWrongVelocityIsFoundAndDepthIsNearlyThatOfExactPoses) {
  const Eigen::Vector3d linear_m_s = 0.05 * Eigen::Vector3d(2, -1, 1).normalized();
  const Eigen::Vector3d angular_rad_s =
      5 * kRadiansPerDegree * Eigen::Vector3d(1, 2, -2).normalized();
  const double exact = error(map(truth(), false));
  for (const double sign : {1.0, -1.0}) {
    const Trajectory wrong =
        correctedTrajectory(truth(), window(), {-sign * linear_m_s, -sign * angular_rad_s});
    const KeyframeDepthMap corrected = map(wrong, true);
    ASSERT_TRUE(corrected.motion_correction);
    // At the ends of the window, 0.1 s away, 0.1 degrees are half a pixel, as wide as a vote. A
    // shift looks like a rotation unless depths differ: half of the shift is found.
    EXPECT_LT((corrected.motion_correction->angular_rad_s - sign * angular_rad_s).norm(),
              1.0 * kRadiansPerDegree);
    EXPECT_LT((corrected.motion_correction->linear_m_s - sign * linear_m_s).norm(), 0.035);
    EXPECT_LT(error(corrected), 1.5 * exact);
    EXPECT_LT(error(corrected), 0.6 * error(map(wrong, false)));
  }
}

TEST_F(MotionCorrectionOnTheDesk, ExactPosesStayAsTheyAre) {
  const KeyframeDepthMap kept = map(truth(), true);
  EXPECT_FALSE(kept.motion_correction);
  EXPECT_TRUE(test::same(kept.map, map(truth(), false).map));
}

}  // namespace
}  // namespace efm
