// SPDX-License-Identifier: BSD-3-Clause
// `event-fusion` with [refinement] enabled.

#include "maps/metrics/trajectory_metrics.h"
#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

using testing::Contains;
using testing::Not;

const std::string kRefined = " --set refinement.enabled=true";

class RefinementOption : public AppTest {
 protected:
  RefinementOption() { write(SyntheticRecording(1.3)); }

  /// A keyframe each 0.1 s, from the recording in "data".
  Result map(const std::string& arguments, const std::string& name) const {
    const Result result =
        run("map rig.ini data --set keyframes.window_s=0.1 " + arguments + " --out " + name);
    EXPECT_EQ(result.status, 0) << result.err;
    return result;
  }
};

/// Root mean square of the relative errors between neighbours.
double relativeError(const std::vector<StampedPose>& poses, const std::vector<StampedPose>& truth) {
  std::vector<PosePair> pairs;
  EXPECT_EQ(poses.size(), truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    pairs.push_back({truth[i].t_ns, poses[i].T_world_rig, truth[i].T_world_rig});
  }
  double squares = 0;
  const auto errors = relativeErrors(pairs, {RelativeSpacing::Unit::kFrames, 1}).translation_m;
  for (const double error_m : errors) squares += error_m * error_m;
  return std::sqrt(squares / static_cast<double>(errors.size()));
}

TEST_F(RefinementOption, WritesTheRefinedPosesAndTheTrackers) {
  map("", "exact");
  const auto truth = posesIn("exact");
  const std::string begin = formatSeconds(truth.front().t_ns - 50'000'000);
  map("--perturb keyframe_noise_m=0.01,keyframe_noise_deg=0.3,keyframe_start_s=" + begin + kRefined,
      "refined");

  const auto tracker = posesIn("refined", "trajectory_tracker.txt");
  const auto refined = posesIn("refined");
  ASSERT_EQ(tracker.size(), truth.size());
  ASSERT_EQ(refined.size(), truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) EXPECT_EQ(refined[i].t_ns, tracker[i].t_ns);
  EXPECT_GT(relativeError(tracker, truth), 0.01);
  EXPECT_LT(relativeError(refined, truth), relativeError(tracker, truth));

  const auto report = reportIn("refined");
  EXPECT_GT(report["seconds"]["refine"], 0);
  EXPECT_LE(report["seconds"]["refine"], report["seconds"]["total"]);
  EXPECT_GT(report["refinement"]["registered"], truth.size() / 2);
  EXPECT_LT(report["refinement"]["registered"], truth.size());
  for (const char* key : {"loop_checks", "loops", "loops_dropped"}) {
    EXPECT_TRUE(report["refinement"][key].is_number_unsigned()) << key;
  }
  for (const char* key : {"noise_m", "noise_deg", "drift", "drift_deg_per_m"}) {
    EXPECT_GT(report["refinement"]["tracker"][key], 0) << key;
  }
  EXPECT_EQ(report["options"]["refinement"]["enabled"], true);
  EXPECT_EQ(report["options"]["refinement"]["tracker_noise_deg"], 0.5);
  EXPECT_EQ(report["options"]["refinement"]["loop_max_sigma_deg"], 0.5);
}

TEST_F(RefinementOption, IsTheSameForAnyThreadsAndInTheBackground) {
  const std::string wrong = "--perturb keyframe_noise_m=0.01,keyframe_s=0.1" + kRefined;
  map(wrong, "once");
  map(wrong + " --set refinement.background=true --set performance.threads=3", "again");
  for (const char* file :
       {"map.pcd", "map.simplemap", "trajectory.txt", "trajectory_tracker.txt"}) {
    EXPECT_EQ(contentOf(std::string("again/") + file), contentOf(std::string("once/") + file))
        << file;
  }
}

TEST_F(RefinementOption, WithoutRefinementThereIsNoTrajectoryOfTheTracker) {
  map("", "out");
  const std::string points = contentOf("out/map.pcd");
  EXPECT_THAT(filesIn("out"), Not(Contains("trajectory_tracker.txt")));
  EXPECT_EQ(reportIn("out")["seconds"]["refine"], 0);
  EXPECT_FALSE(reportIn("out").contains("refinement"));

  map(kRefined, "out");
  EXPECT_THAT(filesIn("out"), Contains("trajectory_tracker.txt"));
  map("", "out");  // shorter, and the earlier run's is gone
  EXPECT_THAT(filesIn("out"), Not(Contains("trajectory_tracker.txt")));
  EXPECT_EQ(contentOf("out/map.pcd"), points);
}

TEST_F(RefinementOption, OneKeyframeHasTheTrackersPose) {
  const std::string depth = "depth rig.ini data --t0 10.2 --t1 10.4";
  ASSERT_EQ(run(depth + " --out one").status, 0);
  for (const char* background : {"false", "true"}) {
    const Result refined =
        run(depth + kRefined + " --set refinement.background=" + background + " --out refined");
    ASSERT_EQ(refined.status, 0) << refined.err;
    EXPECT_EQ(refined.err, "");
    EXPECT_EQ(contentOf("refined/points.pcd"), contentOf("one/points.pcd"));
    EXPECT_EQ(filesIn("refined"), filesIn("one"));
  }
}

}  // namespace
}  // namespace efm
