// SPDX-License-Identifier: BSD-3-Clause
// `--poses`, `--calibration` and `--hand-eye`, and the same in the .ini, as a user gives them.

#include <regex>

#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

using testing::HasSubstr;

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
