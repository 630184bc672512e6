// SPDX-License-Identifier: BSD-3-Clause
// Tests a tracker that is wrong within the window, on the simulated desk.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "mapping/depth/peak_fit.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "mapping/motion/motion_correction.h"
#include "mapping/motion/slice_alignment.h"
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
    options.motion.correct_motion =
        correct_motion ? MotionCorrectionUse::kAlways : MotionCorrectionUse::kNever;
    options.motion.motion_rounds = 3;
    KeyframeMapper mapper(desk().simulation().rig, {0, 1}, options);
    return mapper.map(window(), events(), trajectory).value();
  }

  /// Returns the events of the window, per camera.
  static std::vector<EventSpan> events() {
    std::vector<EventSpan> events;
    for (const std::vector<Event>& camera : desk().events()) {
      const auto end = std::find_if(camera.begin(), camera.end(), [](const Event& event) {
        return event.t_ns >= window().t1_ns;
      });
      events.emplace_back(camera.data(), camera.data() + (end - camera.begin()));
    }
    return events;
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

/// A constant wrong velocity, and a walk as of a tracker: both are found, and the depth is that of
/// exact poses.
TEST_F(MotionCorrectionOnTheDesk, AWrongMotionIsFoundAndDepthIsThatOfExactPoses) {
  Vector6d velocity;
  velocity << 0.05 * Eigen::Vector3d(2, -1, 1).normalized(),
      5 * kRadiansPerDegree * Eigen::Vector3d(1, 2, -2).normalized();
  const double exact = error(map(truth(), false));
  for (const bool walks : {false, true}) {
    MotionCorrection wrong = knotsOf(window(), 0.01);
    for (std::size_t i = 0; i < wrong.knots.size(); ++i) {
      const double since_s = wrong.sinceReference(i);
      wrong.knots[i] = (walks ? std::sin(50 * since_s) / 25 : since_s) * velocity;
    }
    const Trajectory tracked = correctedTrajectory(truth(), window(), wrong);
    const KeyframeDepthMap corrected = map(tracked, true);
    ASSERT_TRUE(corrected.motion_correction);
    EXPECT_LT(error(corrected), 1.1 * exact);
    EXPECT_GT(error(map(tracked, false)), 1.5 * exact);
    // A turn of a tenth of a degree moves the image by half a pixel, as wide as a vote. A shift
    // looks like a turn unless depths differ: it is found less well.
    double turn = 0;
    for (std::size_t i = 0; i < wrong.knots.size(); ++i) {
      const Vector6d left = corrected.motion_correction->knots[i] + wrong.knots[i];
      turn += left.tail<3>().squaredNorm() / static_cast<double>(wrong.knots.size());
    }
    EXPECT_LT(std::sqrt(turn), 0.1 * kRadiansPerDegree);
  }
}

/// Depths as of a blurred window, where many are at a half of the true ones or less: they lie on no
/// edges, and do not bend a right motion.
TEST_F(MotionCorrectionOnTheDesk, WrongDepthsDoNotDecideTheMotion) {
  const KeyframeDepthMap keyframe = map(truth(), false);
  std::vector<UndistortionTable> undistortion;
  const Rig& rig = desk().simulation().rig;
  for (const RigCamera& camera : rig.cameras) undistortion.emplace_back(camera.model);
  std::vector<CameraEvents> cameras;
  for (std::size_t c = 0; c < 2; ++c) {
    cameras.push_back({static_cast<int>(c), &rig.cameras[c], &undistortion[c], events()[c]});
  }
  const DepthPlanes planes;
  const WindowInput input{window(), cameras, keyframe.view, planes, keyframe.T_world_ref};
  const MotionCorrectionOptions options;
  const SliceAlignment slices(input, truth(), options);
  const auto errorWith = [&](double wrong) {  // metres
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(0, 1);
    cv::Mat1f depth = keyframe.map.depth.clone();
    for (float& depth_m : depth) {
      const double scale = uniform(random) < wrong ? 0.3 + 0.2 * uniform(random) : 1;
      depth_m *= static_cast<float>(scale);
    }
    const auto aligned = slices.align(depth, slices.none());
    double squared = 0;
    for (const Vector6d& knot : aligned.value().correction.knots) {
      squared += knot.head<3>().squaredNorm();
    }
    return std::sqrt(squared / static_cast<double>(slices.none().knots.size()));
  };
  EXPECT_LT(errorWith(0.1), 2 * errorWith(0)) << "4 times if all points count alike";
  EXPECT_LT(errorWith(0.2), 0.003) << "5 mm if all points count alike; a slice is right to 0.5 mm";
}

TEST_F(MotionCorrectionOnTheDesk, ExactPosesStayAsTheyAre) {
  const KeyframeDepthMap kept = map(truth(), true);
  EXPECT_FALSE(kept.motion_correction);
  EXPECT_TRUE(test::same(kept.map, map(truth(), false).map));
}

}  // namespace
}  // namespace efm
