// SPDX-License-Identifier: BSD-3-Clause
// Which of the keyframes along corrected motions is taken; `MotionCorrection` tests the correction.
#include "mapping/keyframes/keyframe_mapper.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "test/mapping/keyframes/random_scene.h"

namespace efm::corrected_keyframe_test {
namespace {

struct NoSink : DsiSink {
  void addPlane(int, const float*) override {}
};

TEST(CorrectedKeyframe, IsTheSharpestOfThoseThatGainEnough) {
  const struct {
    const char* what;
    std::vector<double> sharpness;  // of each keyframe, the first along the tracked motion
    int rounds;
    double min_gain;
    bool with_sink;
    int taken;  // its index
    int mapped;
  } cases[] = {
      {"too little", {1, 1.09, 5}, 3, 0.1, false, 0, 2},
      {"enough, then less", {1, 1.11, 1.1, 5}, 3, 0.1, false, 1, 3},
      {"after the first any gain is enough", {1, 1.11, 1.12, 1.13, 5}, 3, 0.1, false, 3, 4},
      {"rounds", {1, 2, 3, 4}, 2, 0.1, false, 2, 3},
      {"nothing is sharp", {0, 0, 5}, 3, 0, false, 0, 2},
      {"the sink has the one that is taken", {1, 2, 1.5, 2}, 3, 0.1, true, 1, 4},
      {"the sink has the tracked one", {2, 1, 2}, 3, 0.1, true, 0, 3},
  };
  const test::RandomRecording recording(1, 1, 10);
  const ReferenceView view = ReferenceView::of(test::smallCamera());
  const DepthPlanes planes;
  const std::vector<CameraEvents> no_cameras;  // so that the correction is none
  for (const auto& c : cases) {
    SCOPED_TRACE(c.what);
    MotionCorrectionOptions options;
    options.motion_rounds = c.rounds;
    options.min_gain = c.min_gain;
    NoSink sink;
    std::vector<const DsiSink*> sinks;
    std::vector<std::size_t> poses;  // a corrected motion has a pose at the reference
    const auto map_along = [&](const Trajectory& motion, DsiSink* to) {
      KeyframeDepthMap keyframe;
      keyframe.map.depth = cv::Mat1f::zeros(36, 48);
      const double value = std::sqrt(c.sharpness.at(sinks.size()));
      keyframe.map.confidence = cv::Mat1f(1, 1, static_cast<float>(value));
      keyframe.without_pose = sinks.size();
      sinks.push_back(to);
      poses.push_back(motion.poses().size());
      return keyframe;
    };
    const KeyframeDepthMap keyframe =
        mapCorrected({{test::RandomRecording::kWindow, no_cameras, view, planes, {}},
                      recording.trajectory,
                      options,
                      c.with_sink ? &sink : nullptr},
                     map_along);
    ASSERT_EQ(sinks.size(), static_cast<std::size_t>(c.mapped));
    for (std::size_t i = 0; i < sinks.size(); ++i) {
      const bool last = c.with_sink && i + 1 == sinks.size();
      EXPECT_EQ(sinks[i], last ? &sink : nullptr);
      const bool tracked = i == 0 || (last && c.taken == 0);
      EXPECT_EQ(poses[i] == recording.trajectory.poses().size(), tracked) << i;
    }
    EXPECT_EQ(keyframe.without_pose,
              static_cast<std::uint64_t>(c.with_sink ? c.mapped - 1 : c.taken));
    EXPECT_EQ(keyframe.motion_correction.has_value(), c.taken > 0);
  }
}

/// Writes down where stages begin and end.
struct StageLog : StageHook {
  std::string stages;
  void begin(Stage stage) override { stages += "fsd"[static_cast<int>(stage)]; }
  void end(Stage stage) override { stages += "FSD"[static_cast<int>(stage)]; }
};

TEST(Stages, OfAKeyframeAreTheRaysTheSweepAndTheDepth) {
  const test::RandomRecording recording(1, 2, 100);
  KeyframeMapperOptions options;
  for (const bool correct_motion : {false, true}) {
    options.motion.correct_motion = correct_motion;
    KeyframeMapper mapper(recording.rig, {0, 1}, options);
    StageLog log;
    mapper.map(test::RandomRecording::kWindow, recording.spans(), recording.trajectory, nullptr,
               &log);
    // The correction counts as a part of the sweep.
    EXPECT_THAT(log.stages, ::testing::StartsWith(correct_motion ? "sSsSdDsSsSsSdD" : "sSsSdD"));
  }
}

}  // namespace
}  // namespace efm::corrected_keyframe_test
