// SPDX-License-Identifier: BSD-3-Clause
// Tests `event-fusion simulate` with a trajectory and a calibration, as a user runs it.
#include <cstdlib>

#include "mapping/geometry/rig.h"
#include "maps/io/point_cloud_file.h"
#include "plugin/recordings/calibration/calibration_formats.h"
#include "test/plugin/app/app_test.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {
namespace {

using testing::HasSubstr;

class SimulateCommand : public AppTest {
 protected:
  void simulate(const std::string& arguments) const {
    const Result result = run("simulate " + arguments);
    EXPECT_EQ(result.status, 0) << arguments << "\n" << result.err;
  }

  /// Writes three small cameras in three orientations and one second of walking ahead.
  void writeRigAndTrajectory() const {
    std::ofstream chain(folder() / "rig.yaml");
    const char* const models[] = {
        "radtan\n  distortion_coeffs: [-0.3, 0.1, 0.001, -0.002]",
        "equidistant\n  distortion_coeffs: [-0.05, 0.01, -0.02, 0.005]\n"
        "  T_cn_cnm1: [[0, -1, 0, 0.1], [1, 0, 0, 0.02], [0, 0, 1, 0], [0, 0, 0, 1]]",
        "none\n  distortion_coeffs: []\n"
        "  T_cn_cnm1: [[0.96, 0, 0.28, -0.1], [0, 1, 0, 0], [-0.28, 0, 0.96, 0.01], [0, 0, 0, 1]]"};
    for (int i = 0; i < 3; ++i) {
      chain << "cam" << i << ":\n  camera_model: pinhole\n  intrinsics: [50, 51, 31.5, 23]\n"
            << "  resolution: [" << 64 - i << ", " << 48 + i
            << "]\n  distortion_model: " << models[i] << "\n";
    }
    std::ofstream poses(folder() / "walk.txt");
    for (int i = 0; i <= 100; ++i) poses << i * 0.01 << " 0 0 " << i * 0.008 << " 0 0 0 1\n";
  }
};

TEST_F(SimulateCommand, WritesTheGivenRig) {
  writeRigAndTrajectory();
  simulate(
      "--scene room --trajectory walk.txt --calibration rig.yaml --start 0.2 --duration 0.1 "
      "--noise-hz 20 --mismatch 0.05 --refractory-us 2000 --out sim");
  const Rig given = readCamchain(folder() / "rig.yaml");
  const Rig written = readCamchain(folder() / "sim/camchain.yaml");
  ASSERT_EQ(written.cameras.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(written.cameras[i].model, given.cameras[i].model);
    const Rigid3& T_rig_cam = given.cameras[i].T_rig_cam;
    EXPECT_LT((written.cameras[i].T_rig_cam.translation - T_rig_cam.translation).norm(), 1e-12);
    EXPECT_LT(written.cameras[i].T_rig_cam.rotation.angularDistance(T_rig_cam.rotation), 1e-7);
    EXPECT_GT(contentOf("sim/cam" + std::to_string(i) + "/events.txt").size(), 0U);
  }
  EXPECT_THAT(contentOf("sim/depth/index.txt"), HasSubstr("0.200000000"));
}

}  // namespace

// Tests `event-fusion evaluate` on results of `map` and `depth`.

namespace {

using nlohmann::json;
using testing::AllOf;
using testing::IsEmpty;

/// A plane before two cameras that move along x.
class EvaluateCommand : public AppTest {
 protected:
  EvaluateCommand() { write(SyntheticRecording()); }

  void writePlane(const std::filesystem::path& file) const {
    cv::imwrite((folder() / file).string(),
                cv::Mat1f(90, 120, static_cast<float>(SyntheticRecording::kDepthM)));
  }
  json jsonOf(const std::string& arguments) const {
    const Result result = run(arguments + " --json");
    EXPECT_EQ(result.status, 0) << result.err;
    EXPECT_THAT(result.err, IsEmpty());
    return json::parse(result.out);
  }
};

TEST_F(EvaluateCommand, ComparesTheMapOfARecordingWithItsFolder) {
  mapOf("data");
  std::string index;
  for (const StampedPose& pose : posesIn("out"))
    index += formatSeconds(pose.t_ns) + " plane.tiff\n";
  write("data/depth/index.txt", index);
  writePlane("data/depth/plane.tiff");
  std::vector<Eigen::Vector3f> points;
  for (int x = -400; x <= 400; ++x) {
    for (int y = -300; y <= 300; ++y) {
      points.push_back(
          Eigen::Vector3d(0.02 * x, 0.02 * y, SyntheticRecording::kDepthM).cast<float>());
    }
  }
  writePly(folder() / "data" / "gt_cloud.ply", points);

  EXPECT_THAT(run("evaluate depth out data --tolerance-px 1").out,
              AllOf(HasSubstr("mean of maps"), HasSubstr("precision %"),
                    HasSubstr("bad-pix with focal length 100.00 px and baseline 0.1000 m")));
  const json depth = jsonOf("evaluate depth out data");
  EXPECT_EQ(depth["maps"].size(), 4U);
  EXPECT_LT(depth["all"]["median_inverse"], 0.06);
  EXPECT_GT(depth["all"]["delta_1"], 0.9);
  EXPECT_EQ(depth["focal_px"], 100);
  EXPECT_NEAR(depth["baseline_m"], 0.1, 1e-9);
  EXPECT_EQ(depth["truths"], 4 * 90 * 120);
  EXPECT_EQ(depth["without_truth"], 0);

  const json cloud = jsonOf("evaluate map out data --distances 0.1,0.5");
  EXPECT_LT(cloud["accuracy"]["median_m"], 0.2);
  ASSERT_EQ(cloud["curve"].size(), 2U);
  EXPECT_GT(cloud["curve"][1]["within"], 0.9);
  EXPECT_GT(cloud["curve"][1]["completeness"], cloud["curve"][0]["completeness"]);
  const Result table =
      run("evaluate map out/map.pcd data/gt_cloud.ply --to-find out/map.pcd");
  EXPECT_EQ(table.status, 0) << table.err;
  EXPECT_THAT(table.out, AllOf(HasSubstr("outliers %"), HasSubstr("100.00")));

  // The rig moves along a line: least squares cannot find its rotation about the line.
  EXPECT_THAT(errorOf("evaluate trajectory out data"),
              AllOf(HasSubstr("positions lie on a line"), HasSubstr("--align origin")));
  for (const char* alignment : {"none", "origin"}) {
    const json errors = jsonOf(std::string("evaluate trajectory out data --align ") + alignment);
    EXPECT_EQ(errors["pairs"], 4);
    EXPECT_LT(errors["ate"]["translation_m"]["max"], 0.01);
    EXPECT_EQ(errors["alignment"], alignment);
  }
  const json lengths =
      jsonOf("evaluate trajectory data data --align none --lengths 0.1,0.2 --frames 5");
  EXPECT_EQ(lengths["rpe"].size(), 3U);
}

TEST_F(EvaluateCommand, ComparesOneDepthMapWithAFile) {
  ASSERT_EQ(run("depth rig.ini data --out one --t0 10.1 --t1 10.3").status, 0);
  writePlane("truth.tiff");
  const json whole = jsonOf("evaluate depth one truth.tiff --thresholds 0.1,1 --focal 200");
  EXPECT_EQ(whole["curve"].size(), 2U);
  EXPECT_EQ(whole["focal_px"], 200) << "what is given goes before what is found";
  EXPECT_GT(whole["all"]["points"], 50);
  EXPECT_EQ(jsonOf("evaluate depth one/depth.tiff truth.tiff")["all"]["points"],
            whole["all"]["points"]);

  cv::Mat1b mask(90, 120, uchar{0});
  mask.colRange(0, 60).setTo(255);
  cv::imwrite((folder() / "mask.png").string(), mask);
  const json half = jsonOf("evaluate depth one truth.tiff --mask mask.png");
  EXPECT_LT(half["all"]["points"], whole["all"]["points"]);
  EXPECT_EQ(half["truths"], 90 * 60);
}

}  // namespace

// Tests `event-fusion view` as a user runs it, with a fake opener in the PATH.

namespace {

class ViewCommand : public AppTest {
 protected:
  /// Installs an opener that ends with `status`.
  void putOpener(int status) {
    write("bin/xdg-open", "#!/bin/sh\necho \"$1\" >opened.txt\necho chatter\nexit " +
                              std::to_string(status) + "\n");
    std::filesystem::permissions(folder() / "bin" / "xdg-open", std::filesystem::perms::owner_all);
    setenv("PATH", ((folder() / "bin").string() + ":" + path_).c_str(), 1);
    setenv("DISPLAY", ":0", 1);
  }
  ~ViewCommand() override {
    setenv("PATH", path_.c_str(), 1);
    unsetenv("DISPLAY");
  }

  std::string path_ = std::getenv("PATH");
};

TEST_F(ViewCommand, OpensThePageOfAFolder) {
  putOpener(0);
  write("my map/map.html", "a page");
  const std::string page = (folder() / "my map" / "map.html").string();
  for (const char* arguments : {"view 'my map'", "view 'my map/'", "view 'my map/map.html'"}) {
    const Result result = run(arguments);
    EXPECT_EQ(result.status, 0) << arguments;
    EXPECT_THAT(result.err, IsEmpty()) << arguments;
    EXPECT_EQ(result.out, page + "\n") << arguments;
    EXPECT_EQ(contentOf("opened.txt"), page + "\n") << arguments;
    std::filesystem::remove(folder() / "opened.txt");
  }
}

TEST_F(ViewCommand, SaysWhereThePageIsIfNothingOpensIt) {
  putOpener(4);
  write("out/map.html", "a page");
  const Result failed = run("view out");
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  std::filesystem::remove(folder() / "opened.txt");
  const Result without_screen = run("view out");
  for (const Result& result : {failed, without_screen}) {
    EXPECT_EQ(result.status, 0);
    EXPECT_EQ(result.out, (folder() / "out" / "map.html").string() + "\n");
    EXPECT_THAT(result.err, HasSubstr("no browser could be started here: open the file in one"));
  }
  EXPECT_FALSE(exists(folder() / "opened.txt")) << "a browser of the terminal shows no map";
}

}  // namespace

}  // namespace efm
