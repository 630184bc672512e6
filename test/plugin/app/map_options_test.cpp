// SPDX-License-Identifier: BSD-3-Clause
// Options of `event-fusion map` and `depth` that change the output.
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include <regex>

#include "maps/io/point_cloud_file.h"
#include "maps/metrics/trajectory_metrics.h"
#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

using nlohmann::json;
using testing::AnyOf;
using testing::Each;
using testing::HasSubstr;
using testing::Not;

class MapOptions : public AppTest {
 protected:
  std::size_t pointsIn(const std::filesystem::path& file) const {
    return readPointCloud(folder() / file).points.size();
  }
};

TEST_F(MapOptions, TheSequencesWhiteLevelIsComputedInAFirstPass) {
  write(SyntheticRecording());
  ASSERT_EQ(run("map rig.ini data --out out --set depth.max_confidence=sequence").status, 0);

  const json report = reportIn("out");
  EXPECT_EQ(report["options"]["depth"]["max_confidence"], "sequence");
  std::vector<double> maxima;
  for (const StampedPose& pose : posesIn("out")) {
    double largest = 0;
    cv::minMaxLoc(image("out/keyframes/" + formatSeconds(pose.t_ns) + "/confidence.tiff"), nullptr,
                  &largest);
    maxima.push_back(largest);
  }
  // Of fewer than twenty keyframes the robust maximum is the plain one.
  const double expected = *std::max_element(maxima.begin(), maxima.end());
  EXPECT_EQ(report["sequence_maximum"], expected);

  std::ostringstream number;
  number.precision(17);
  number << "depth.max_confidence=" << expected;
  ASSERT_EQ(run("map rig.ini data --out fixed --set " + number.str()).status, 0);
  EXPECT_EQ(contentOf("out/map.pcd"), contentOf("fixed/map.pcd"));
}

TEST_F(MapOptions, SingleCamerasKeepTheirOwnWhiteLevel) {
  write(SyntheticRecording());
  const std::string maps = "map rig.ini data --set output.camera_maps=true ";
  ASSERT_EQ(run(maps + "--out own").status, 0);
  ASSERT_EQ(run(maps + "--out all --set depth.max_confidence=sequence").status, 0);
  for (const std::string& file : filesIn("own")) {
    if (file.find("/cam") == std::string::npos) continue;
    EXPECT_EQ(contentOf(folder() / "own" / file), contentOf(folder() / "all" / file)) << file;
  }
}

TEST_F(MapOptions, OneKeyframeHasTheWhiteLevelOfTheWholeRecording) {
  write(SyntheticRecording());
  const std::string sequence = " --set depth.max_confidence=sequence";
  ASSERT_EQ(run("map rig.ini data --out out" + sequence).status, 0);
  ASSERT_EQ(run("depth rig.ini data --t0 10.1 --t1 10.4 --out one" + sequence).status, 0);
  EXPECT_EQ(reportIn("one")["sequence_maximum"], reportIn("out")["sequence_maximum"]);
}

TEST_F(MapOptions, WhatTheOutputSectionAsksForIsWrittenToo) {
  write(SyntheticRecording());
  // With slices of time a camera alone is fused across them.
  const std::string map = "map rig.ini data --set fusion.time_slices=1 ";
  ASSERT_EQ(run(map + "--out out --set output.camera_maps=true --set output.event_images=true "
                      "--set output.ply=true")
                .status,
            0);
  EXPECT_EQ(pointsIn("out/map.ply"), pointsIn("out/map.pcd"));
  ASSERT_EQ(run(map + "--out alone --set rig.cameras=1").status, 0);
  const auto poses = posesIn("out");
  for (const StampedPose& pose : poses) {
    const std::filesystem::path keyframe = "keyframes/" + formatSeconds(pose.t_ns);
    const cv::Mat beside = image("out" / keyframe / "cam1" / "depth.tiff");
    const cv::Mat alone = image("alone" / keyframe / "depth.tiff");
    ASSERT_FALSE(beside.empty());
    EXPECT_EQ(cv::norm(beside, alone, cv::NORM_INF), 0) << "the view is camera 0's in both";
    EXPECT_FALSE(image("out" / keyframe / "cam0" / "events.png").empty());
  }

  // A run without them leaves none behind.
  ASSERT_EQ(run("map rig.ini data --out out").status, 0);
  EXPECT_THAT(filesIn("out"), Each(Not(AnyOf(HasSubstr("cam"), HasSubstr("ply")))));
}

TEST_F(MapOptions, LateFusionJoinsTheCloudsOfSingleCameras) {
  write(SyntheticRecording());
  const std::string depth =
      "depth rig.ini data --t0 10.1 --t1 10.4 --set map.voxel_size_m=0.001 "
      "--set fusion.time_slices=1 ";
  ASSERT_EQ(run(depth + "--out both --set fusion.late=true").status, 0);
  ASSERT_EQ(run(depth + "--out first --set rig.cameras=0").status, 0);
  ASSERT_EQ(run(depth + "--out second --set rig.cameras=1").status, 0);
  EXPECT_GT(pointsIn("first/points.pcd"), 0U);
  EXPECT_EQ(pointsIn("both/points.pcd"),
            pointsIn("first/points.pcd") + pointsIn("second/points.pcd"));
}

TEST_F(MapOptions, OutliersAreRemovedFromTheCloudOfOneKeyframeToo) {
  write(SyntheticRecording());
  const std::string depth = "depth rig.ini data --t0 10.1 --t1 10.4 ";
  ASSERT_EQ(run(depth + "--out all").status, 0);
  ASSERT_EQ(run(depth + "--out some --set map.outlier_radius_m=0.05"
                        " --set map.outlier_min_neighbors=4")
                .status,
            0);
  EXPECT_LT(pointsIn("some/points.pcd"), pointsIn("all/points.pcd"));
  EXPECT_EQ(reportIn("some")["points"], pointsIn("some/points.pcd"));
}

TEST_F(MapOptions, OtherFilesAreWrittenIfOneCannotBeWritten) {
  write(SyntheticRecording());
  std::filesystem::create_directories(folder() / "out" / "map.pcd" / "in the way");
  const Result result = run("map rig.ini data --out out --force");
  EXPECT_NE(result.status, 0);
  EXPECT_THAT(result.err, HasSubstr("map.pcd"));
  for (const char* file : {"map.simplemap", "trajectory.txt", "report.json"}) {
    EXPECT_TRUE(exists(folder() / "out" / file)) << file;
  }
}

TEST_F(MapOptions, OneLineIsEnough) {
  write(SyntheticRecording());
  const std::string defaults = " --set dsi.num_planes=20";
  ASSERT_EQ(run("map " EFM_SOURCE_DIR "/config/default.ini data --out out" + defaults).status, 0);
  const std::string map = contentOf("out/map.pcd");
  ASSERT_EQ(run("map data" + defaults).status, 0);
  EXPECT_EQ(contentOf("data_map/map.pcd"), map);
  ASSERT_EQ(run("map --config default data/ -o again" + defaults).status, 0);
  EXPECT_EQ(contentOf("again/map.pcd"), map);
  EXPECT_EQ(run("depth data/ --t0 +0.1 --duration 0.2" + defaults).status, 0);
  EXPECT_TRUE(exists(folder() / "data_depth" / "depth.tiff"));
  EXPECT_THAT(errorOf("map --config nothing data"), HasSubstr("one of davis240c_rpg, "));
  EXPECT_THAT(errorOf("map --config default rig.ini data"), HasSubstr("a second option file"));
  EXPECT_THAT(errorOf("map rig.ini"), HasSubstr("SOURCE"));
  EXPECT_THAT(errorOf("map nowhere.ini data"), HasSubstr("nowhere.ini"));
}

TEST_F(MapOptions, NamesThatAreNotUtf8CostNoResult) {
  write(SyntheticRecording());
  std::filesystem::rename(folder() / "data", folder() / "d\xe9");
  std::filesystem::rename(folder() / "rig.ini", folder() / "r\xe9.ini");
  for (const char* time : {"first", "again, with the same recording"}) {
    const Result result =
        run("map 'd\xe9' --config 'r\xe9.ini' --poses 'd\xe9/poses.txt' "
            "--calibration 'd\xe9/camchain.yaml' --out 'o\xe9'");
    EXPECT_EQ(result.status, 0) << time;
    EXPECT_EQ(result.err, "") << time;
  }
  const std::string unknown = "\xef\xbf\xbd";  // U+FFFD
  EXPECT_EQ(reportIn("o\xe9")["options"]["rig"]["calibration"], "d" + unknown + "/camchain.yaml");
  EXPECT_THAT(contentOf("o\xe9/map.html"), HasSubstr("{\"name\":\"o" + unknown + "\","));
  const Result evaluation =
      run("evaluate trajectory 'o\xe9/trajectory.txt' 'd\xe9/poses.txt' --align none --json");
  EXPECT_EQ(evaluation.status, 0) << evaluation.err;
  EXPECT_EQ(json::parse(evaluation.out)["truth_file"], "d" + unknown + "/poses.txt");
}

}  // namespace

// `--perturb` as a user gives it.

namespace {

class PerturbOption : public AppTest {
 protected:
  PerturbOption() { write(SyntheticRecording()); }
};

TEST_F(PerturbOption, WithZeroFaultsChangesNothing) {
  const std::string map = mapOf("data");
  EXPECT_EQ(mapOf("data --perturb noise_m=0,drop=0,seed=3", "zero"), map);
  EXPECT_FALSE(reportIn("zero").contains("perturbation"));
}

TEST_F(PerturbOption, WithLatencyOnlyMakesTheSameMap) {
  const std::string map = mapOf("data");
  for (const char* latency_s : {"0.2", "0.7"}) {
    EXPECT_EQ(mapOf(std::string("data --perturb latency_s=") + latency_s, "late"), map);
    EXPECT_EQ(contentOf("late/trajectory.txt"), contentOf("out/trajectory.txt"));
  }
}

TEST_F(PerturbOption, IsInTheReport) {
  const std::string map = mapOf("data");
  EXPECT_FALSE(reportIn("out").contains("perturbation"));
  const std::string other =
      mapOf("data --perturb noise_m=0.01,keyframe_noise_m=0.02 --perturb seed=5", "wrong");
  EXPECT_NE(other, map);
  EXPECT_EQ(mapOf("data --perturb keyframe_noise_m=0.02,noise_m=0.01,seed=5", "again"), other);
  const auto perturbation = reportIn("wrong")["perturbation"];
  EXPECT_EQ(perturbation["noise_m"], 0.01);
  EXPECT_EQ(perturbation["seed"], 5);
  EXPECT_EQ(perturbation["keyframe_s"], 0.1) << "the stride";
  EXPECT_EQ(perturbation["drop"], 0);
}

TEST_F(PerturbOption, IsWrittenToARawlogByImport) {
  const std::string perturb =
      " --perturb keyframe_noise_m=0.02,keyframe_s=0.07,noise_m=0.001,drift=0.01";
  const std::string map = mapOf("data" + perturb);
  ASSERT_EQ(run("import data --out wrong.rawlog" + perturb).status, 0);
  EXPECT_EQ(mapOf("wrong.rawlog", "from_rawlog"), map);
  // 51 poses; stretches begin at 70, 140, ..., 490 ms, at poses, of which each needs one more.
  EXPECT_THAT(run("info wrong.rawlog").out, HasSubstr("58 poses from"));
  EXPECT_THAT(run("info data --perturb latency_s=0.2").out, HasSubstr("51 poses from"));
}

}  // namespace

// `event-fusion` with [refinement] enabled.

namespace {

using testing::Contains;

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

// `--poses`, `--calibration` and `--hand-eye`, and the same in the .ini, as a user gives them.

namespace {

namespace fs = std::filesystem;

class OverrideOptions : public AppTest {
 protected:
  OverrideOptions() { write(SyntheticRecording()); }

  /// Takes a file out of the recording's folder, into the one around it.
  void takeOut(const std::string& name) const {
    fs::rename(folder() / "data" / name, folder() / name);
  }

  /// The recording's poses as a tracker gives them whose body the rig is turned and moved on.
  void writePosesOfTheBody() const {
    write("hand_eye.yaml",
          "T_body_rig: [[0, 0, 1, 0.4], [-1, 0, 0, 0.2], [0, -1, 0, -0.1], [0, 0, 0, 1]]\n");
    Eigen::Matrix3d rotation;
    rotation << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    const Rigid3 T_body_rig = {Eigen::Quaterniond(rotation), {0.4, 0.2, -0.1}};
    std::vector<StampedPose> poses = SyntheticRecording().poses;
    for (StampedPose& pose : poses) pose.T_world_rig = pose.T_world_rig * T_body_rig.inverse();
    writeTumTrajectory(folder() / "body.txt", poses);
  }
};

TEST_F(OverrideOptions, ExternalPosesAndCalibrationMakeTheSameMap) {
  const std::string map = mapOf("data");
  takeOut("poses.txt");
  EXPECT_EQ(mapOf("data --poses poses.txt"), map);
  takeOut("camchain.yaml");
  EXPECT_EQ(mapOf("data --poses poses.txt --calibration camchain.yaml"), map);
  EXPECT_EQ(run("info data --poses poses.txt --calibration camchain.yaml").status, 0);
  const std::string depth = "depth rig.ini data --out one --t0 10.1 --t1 10.3 ";
  EXPECT_EQ(run(depth + "--poses poses.txt --calibration camchain.yaml").status, 0);
}

TEST_F(OverrideOptions, TheyReplaceThePartsOfTheRecording) {
  ASSERT_EQ(run("import data --out r.rawlog").status, 0);
  const std::string map = mapOf("data");

  std::vector<StampedPose> poses = SyntheticRecording().poses;
  for (StampedPose& pose : poses) pose.T_world_rig.translation.y() += 5;
  writeTumTrajectory(folder() / "moved.txt", poses);
  Rig rig{SyntheticRecording().cameras};
  for (RigCamera& camera : rig.cameras) camera.model.cx += 3;
  write("other.yaml", formatCamchain(rig));
  const std::string options = " --poses moved.txt --calibration other.yaml";

  const std::string other = mapOf("data" + options);
  EXPECT_NE(other, map);
  EXPECT_NEAR(posesIn("out")[0].T_world_rig.translation.y(), 5, 1e-12);
  EXPECT_EQ(mapOf("r.rawlog" + options), other) << "a rawlog's are replaced, too";
  ASSERT_EQ(run("import r.rawlog --out other.rawlog" + options).status, 0);
  EXPECT_EQ(mapOf("other.rawlog"), other) << "import writes what was given";
}

TEST_F(OverrideOptions, AHandEyeTransformMakesPosesOfTheRigFromPosesOfTheBody) {
  mapOf("data");
  const auto expected = posesIn("out");
  writePosesOfTheBody();

  const std::string options = " --poses body.txt --hand-eye hand_eye.yaml";
  const std::string map = mapOf("data" + options);
  const auto keyframes = posesIn("out");
  ASSERT_EQ(keyframes.size(), expected.size());
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    const Rigid3 T_ref_expected = keyframes[k].T_world_rig.inverse() * expected[k].T_world_rig;
    EXPECT_LT(T_ref_expected.translation.norm(), 1e-9);
    EXPECT_LT(T_ref_expected.rotation.vec().norm(), 1e-9);
  }

  ASSERT_EQ(run("import data --out r.rawlog" + options).status, 0);
  EXPECT_EQ(mapOf("r.rawlog"), map) << "a rawlog remembers it";
  EXPECT_EQ(mapOf("r.rawlog --hand-eye hand_eye.yaml"), map) << "given twice is given once";
}

TEST_F(OverrideOptions, TheCommandLineOverridesTheOptionFile) {
  mapOf("data");
  const auto expected = posesIn("out");
  writePosesOfTheBody();
  fs::create_directory(folder() / "rigs");
  fs::rename(folder() / "hand_eye.yaml", folder() / "rigs" / "hand_eye.yaml");
  takeOut("camchain.yaml");
  fs::rename(folder() / "camchain.yaml", folder() / "rigs" / "camchain.yaml");
  std::string options = contentOf("rig.ini");
  options = std::regex_replace(options, std::regex("calibration = *"), "calibration=camchain.yaml");
  options = std::regex_replace(options, std::regex("hand_eye = *"), "hand_eye = hand_eye.yaml");
  write("rigs/rig.ini", options);

  const std::string map = "map rigs/rig.ini data --poses body.txt --out out";
  ASSERT_EQ(run(map).status, 0) << run(map).err;
  EXPECT_NEAR(
      (posesIn("out")[0].T_world_rig.inverse() * expected[0].T_world_rig).translation.norm(), 0,
      1e-9);
  EXPECT_EQ(reportIn("out")["options"]["rig"]["hand_eye"], "rigs/hand_eye.yaml");

  write("none.yaml", "T_body_rig: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n");
  ASSERT_EQ(run(map + " --hand-eye none.yaml").status, 0);
  EXPECT_GT((posesIn("out")[0].T_world_rig.inverse() * expected[0].T_world_rig).translation.norm(),
            0.1);
  EXPECT_THAT(errorOf(map + " --set rig.calibration="), HasSubstr("data: no calibration"));
}

TEST_F(OverrideOptions, AHandEyeTransformInMillimetresIsSaidFirst) {
  mapOf("data");
  writePosesOfTheBody();
  write("mm.yaml", "T_body_rig: [[1, 0, 0, 40], [0, 1, 0, 30], [0, 0, 1, 0], [0, 0, 0, 1]]\n");
  for (const std::string command : {"map rig.ini data --out out", "info data --quiet"}) {
    const std::string told = run(command + " --poses body.txt --hand-eye mm.yaml").err;
    const std::size_t first = told.find("warning: ");
    ASSERT_NE(first, std::string::npos) << command;
    EXPECT_THAT(told.substr(first),
                testing::StartsWith("warning: long-lever: the rig is 50 m from the tracked body: "
                                    "expected at most 20; is the translation of T_body_rig in "
                                    "metres (--hand-eye)?"));
  }
}

TEST_F(OverrideOptions, AnOptionFileThatReplacesARecordingsCalibrationIsAWarning) {
  ASSERT_EQ(run("import data --out r.rawlog").status, 0);
  fs::copy_file(folder() / "data" / "camchain.yaml", folder() / "same.yaml");
  Rig rig{SyntheticRecording().cameras};
  rig.cameras[1].T_rig_cam.translation.y() += 0.001;
  write("other.yaml", formatCamchain(rig));
  for (const std::string recording : {"data", "r.rawlog"}) {
    const std::string map = "map rig.ini " + recording + " --out of_" + recording + " ";
    EXPECT_EQ(run(map + "--set rig.calibration=same.yaml").err, "") << recording;
    EXPECT_THAT(run(map + "--set rig.calibration=other.yaml").err,
                HasSubstr("warning: calibration-replaced: other.yaml replaced another calibration, "
                          "the recording's own; "
                          "--set rig.calibration= keeps that"))
        << recording;
    EXPECT_EQ(run(map + "--calibration other.yaml").err, "") << recording << ": it was asked for";
  }
  takeOut("camchain.yaml");
  EXPECT_EQ(run("map rig.ini data --out of_data --set rig.calibration=other.yaml").err, "")
      << "there is no other";
}

TEST_F(OverrideOptions, TimeOffsetsMoveACamerasEventsToThePosesClock) {
  SyntheticRecording recording;
  write(recording);
  const std::string map = mapOf("data");
  for (Event& event : recording.events[1]) event.t_ns += 42'000'000;
  write(recording);
  EXPECT_NE(mapOf("data"), map);
  EXPECT_EQ(mapOf("data --set rig.time_offsets_s=0,-0.042"), map);
  EXPECT_THAT(errorOf("map rig.ini data --out out --set rig.time_offsets_s=0,0,0"),
              HasSubstr("time_offsets_s (how many) = 3: must be one per camera"));
}

}  // namespace

}  // namespace efm
