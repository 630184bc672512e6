// SPDX-License-Identifier: BSD-3-Clause
// Options of `event-fusion map` and `depth` that change the output.

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "maps/io/point_cloud_file.h"
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
}  // namespace efm
