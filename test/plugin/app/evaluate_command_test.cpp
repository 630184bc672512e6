// SPDX-License-Identifier: BSD-3-Clause
// `event-fusion evaluate` on results of `map` and `depth`.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "mapping/geometry/trajectory.h"
#include "maps/io/point_cloud_file.h"
#include "test/plugin/app/app_test.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

/// A plane before two cameras that move along x: mapped to "out" or "one", with its truth.
class EvaluateCommand : public AppTest {
 protected:
  EvaluateCommand() { write(SyntheticRecording()); }

  /// The truth of every keyframe of "out", as a dataset has it.
  void writeTrueDepths() const {
    std::filesystem::create_directories(folder() / "data" / "depth");
    std::ofstream index(folder() / "data" / "depth" / "index.txt");
    for (const StampedPose& pose : posesIn("out")) {
      index << formatSeconds(pose.t_ns) << " plane.tiff\n";
    }
    writePlane(folder() / "data" / "depth" / "plane.tiff");
  }
  void writePlane(const std::filesystem::path& file) const {
    cv::imwrite(file.string(), cv::Mat1f(90, 120, static_cast<float>(SyntheticRecording::kDepthM)));
  }
  void writeTrueCloud() const {
    std::vector<Eigen::Vector3f> points;
    for (int x = -400; x <= 400; ++x) {
      for (int y = -300; y <= 300; ++y) {
        points.push_back(
            Eigen::Vector3d(0.02 * x, 0.02 * y, SyntheticRecording::kDepthM).cast<float>());
      }
    }
    writePly(folder() / "data" / "gt_cloud.ply", points);
  }
  json jsonOf(const std::string& arguments) const {
    const Result result = run(arguments + " --json");
    EXPECT_EQ(result.status, 0) << result.err;
    EXPECT_THAT(result.err, IsEmpty());
    return json::parse(result.out);
  }
};

TEST_F(EvaluateCommand, ComparesTheMapsOfARecordingWithItsFolder) {
  ASSERT_EQ(run("map rig.ini data --out out").status, 0);
  writeTrueDepths();

  const Result table = run("evaluate depth out data --tolerance-px 1");
  EXPECT_EQ(table.status, 0) << table.err;
  EXPECT_THAT(table.out,
              AllOf(HasSubstr("mean of maps"), HasSubstr("precision %"),
                    HasSubstr("bad-pix with focal length 100.00 px and baseline 0.1000 m")));

  const json errors = jsonOf("evaluate depth out data");
  EXPECT_EQ(errors["maps"].size(), 4U);
  EXPECT_LT(errors["all"]["median_inverse"], 0.06);
  EXPECT_GT(errors["all"]["delta_1"], 0.9);
  EXPECT_EQ(errors["focal_px"], 100);
  EXPECT_NEAR(errors["baseline_m"], 0.1, 1e-9);
  EXPECT_EQ(errors["truths"], 4 * 90 * 120);
  EXPECT_EQ(errors["without_truth"], 0);
}

TEST_F(EvaluateCommand, ComparesOneDepthMapWithAFile) {
  ASSERT_EQ(run("depth rig.ini data --out one --t0 10.1 --t1 10.3").status, 0);
  writePlane(folder() / "truth.tiff");

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
  EXPECT_THAT(errorOf("evaluate depth one truth.tiff --max-depth 0.5"), HasSubstr("no pixel"));
}

TEST_F(EvaluateCommand, ComparesTheCloudWithTheSurfaces) {
  ASSERT_EQ(run("map rig.ini data --out out").status, 0);
  writeTrueCloud();
  const json errors = jsonOf("evaluate map out data --distances 0.1,0.5");
  EXPECT_LT(errors["accuracy"]["median_m"], 0.2);
  ASSERT_EQ(errors["curve"].size(), 2U);
  EXPECT_GT(errors["curve"][1]["within"], 0.9);
  EXPECT_GT(errors["curve"][1]["completeness"], errors["curve"][0]["completeness"]);
  const Result table =
      run("evaluate map out/map.pcd data/gt_cloud.ply --to-find out/map.pcd --plot map.png");
  EXPECT_EQ(table.status, 0) << table.err;
  EXPECT_THAT(table.out, AllOf(HasSubstr("outliers %"), HasSubstr("100.00")));
  EXPECT_FALSE(image("map.png").empty());
}

TEST_F(EvaluateCommand, ComparesTheKeyframesTrajectoryWithThePoses) {
  ASSERT_EQ(run("map rig.ini data --out out").status, 0);
  // The rig moves along a line: least squares cannot say how it is turned about that.
  EXPECT_THAT(errorOf("evaluate trajectory out data"),
              AllOf(HasSubstr("positions lie on a line"), HasSubstr("--align origin")));
  for (const char* alignment : {"none", "origin"}) {
    const json errors = jsonOf(std::string("evaluate trajectory out data --align ") + alignment);
    EXPECT_EQ(errors["pairs"], 4);
    EXPECT_LT(errors["ate"]["translation_m"]["max"], 0.01);
    EXPECT_EQ(errors["alignment"], alignment);
  }
  const json errors =
      jsonOf("evaluate trajectory data data --align none --lengths 0.1,0.2 --frames 5");
  EXPECT_EQ(errors["rpe"].size(), 3U);
}

}  // namespace
}  // namespace efm
