// SPDX-License-Identifier: BSD-3-Clause
// Tests options of `event-fusion map` and `depth` that change values of the result. See also
// program_table.txt.
#include <opencv2/core.hpp>

#include <regex>
#include <sstream>

#include "maps/metrics/trajectory_metrics.h"
#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

class MapOptions : public AppTest {
 protected:
  MapOptions() { write(SyntheticRecording()); }
};

TEST_F(MapOptions, TheSequencesWhiteLevelIsComputedInAFirstPass) {
  const std::string sequence = " --set depth.max_confidence=sequence";
  mapOf("data --set output.camera_maps=true" + sequence);
  const nlohmann::json report = reportIn("out");
  EXPECT_EQ(report["options"]["depth"]["max_confidence"], "sequence");
  std::vector<double> maxima;
  for (const StampedPose& pose : posesIn("out")) {
    double largest = 0;
    cv::minMaxLoc(image("out/keyframes/" + formatSeconds(pose.t_ns) + "/confidence.tiff"), nullptr,
                  &largest);
    maxima.push_back(largest);
  }
  // For fewer than twenty keyframes the robust maximum is the plain maximum.
  const double expected = *std::max_element(maxima.begin(), maxima.end());
  EXPECT_EQ(report["sequence_maximum"], expected);
  std::ostringstream number;
  number.precision(17);
  number << expected;
  EXPECT_EQ(mapOf("data --set depth.max_confidence=" + number.str(), "fixed"),
            contentOf("out/map.pcd"));

  mapOf("data --set output.camera_maps=true", "own");
  for (const std::string& file : filesIn("own")) {
    if (file.find("/cam") == std::string::npos) continue;
    EXPECT_EQ(contentOf("own/" + file), contentOf("out/" + file)) << "a camera has its own level";
  }
  ASSERT_EQ(run("depth rig.ini data --t0 10.1 --t1 10.4 --out one" + sequence).status, 0);
  EXPECT_EQ(reportIn("one")["sequence_maximum"], expected) << "that of the whole recording";
}

/// Returns the root mean square of the relative errors between neighbouring poses.
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

TEST_F(MapOptions, RefinedPosesAndTheTrackersAreWritten) {
  writeDataset(SyntheticRecording(1.3), folder() / "long");
  const std::string map = "long --set keyframes.window_s=0.1 ";  // one keyframe per 0.1 s
  mapOf(map, "exact");
  const auto truth = posesIn("exact");
  const std::string begin = formatSeconds(truth.front().t_ns - 50'000'000);
  mapOf(map + "--perturb keyframe_noise_m=0.01,keyframe_noise_deg=0.3,keyframe_start_s=" + begin +
            " --set refinement.enabled=true",
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

TEST_F(MapOptions, AHandEyeTransformMakesPosesOfTheRigFromPosesOfTheBody) {
  const std::string exact = mapOf("data", "exact");
  const auto expected = posesIn("exact");
  // Makes a tracker's poses of a body on which the rig is rotated and moved.
  Eigen::Matrix3d rotation;
  rotation << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Rigid3 T_body_rig = {Eigen::Quaterniond(rotation), {0.4, 0.2, -0.1}};
  std::vector<StampedPose> poses = SyntheticRecording().poses;
  for (StampedPose& pose : poses) pose.T_world_rig = pose.T_world_rig * T_body_rig.inverse();
  writeTumTrajectory(folder() / "body.txt", poses);
  write("rigs/hand_eye.yaml",
        "T_body_rig: [[0, 0, 1, 0.4], [-1, 0, 0, 0.2], [0, -1, 0, -0.1], [0, 0, 0, 1]]\n");
  const auto expectThePosesOfTheRig = [&](const std::string& out) {
    const auto keyframes = posesIn(out);
    ASSERT_EQ(keyframes.size(), expected.size());
    for (std::size_t k = 0; k < keyframes.size(); ++k) {
      const Rigid3 T_ref_expected = keyframes[k].T_world_rig.inverse() * expected[k].T_world_rig;
      EXPECT_LT(T_ref_expected.translation.norm(), 1e-9);
      EXPECT_LT(T_ref_expected.rotation.vec().norm(), 1e-9);
    }
  };
  const std::string options = " --poses body.txt --hand-eye rigs/hand_eye.yaml";
  const std::string map = mapOf("data" + options);
  expectThePosesOfTheRig("out");
  ASSERT_EQ(run("import data --out r.rawlog" + options).status, 0);
  EXPECT_EQ(mapOf("r.rawlog"), map) << "a rawlog remembers it";
  EXPECT_EQ(mapOf("r.rawlog --hand-eye rigs/hand_eye.yaml"), map) << "given twice is given once";

  // File names in an option file are relative to the file. The command line has priority.
  std::filesystem::rename(folder() / "data" / "camchain.yaml", folder() / "rigs" / "camchain.yaml");
  std::string ini = contentOf("rig.ini");
  ini = std::regex_replace(ini, std::regex("calibration = *"), "calibration=camchain.yaml");
  ini = std::regex_replace(ini, std::regex("hand_eye = *"), "hand_eye = hand_eye.yaml");
  write("rigs/rig.ini", ini);
  write("none.yaml", "T_body_rig: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n");
  const std::string in_file = "map rigs/rig.ini data --poses body.txt --out in_file";
  ASSERT_EQ(run(in_file).status, 0);
  expectThePosesOfTheRig("in_file");
  EXPECT_EQ(reportIn("in_file")["options"]["rig"]["hand_eye"], "rigs/hand_eye.yaml");
  ASSERT_EQ(run(in_file + " --hand-eye none.yaml").status, 0);
  const Rigid3 T_rig_body = posesIn("in_file")[0].T_world_rig.inverse() * expected[0].T_world_rig;
  EXPECT_GT(T_rig_body.translation.norm(), 0.1);
  EXPECT_THAT(errorOf(in_file + " --set rig.calibration="),
              testing::HasSubstr("data: no calibration"));
}

}  // namespace
}  // namespace efm
