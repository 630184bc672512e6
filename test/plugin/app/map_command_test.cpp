// SPDX-License-Identifier: BSD-3-Clause
// Tests that results of `event-fusion map` and `depth` are complete and agree. program_table.txt
// has the files and the messages of each command.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <set>

#include "event_fusion/engine.h"
#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

class MapCommand : public AppTest {};

TEST_F(MapCommand, CountsOfTheReportAddUp) {
  const SyntheticRecording recording;
  write(recording);
  const Result result = run("map rig.ini data --out out -v --strict");
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("the clock of the poses could not be checked"));
  EXPECT_EQ(reportIn("out")["quality"]["keyframes"].size(), 4U);
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 4) << "a line per keyframe";
  EXPECT_THAT(result.err, HasSubstr("keyframe 1 at 10.102000000 s (+0.1 s): 639 events, "));
  const auto poses = posesIn("out");
  ASSERT_EQ(poses.size(), 4U);
  for (const StampedPose& pose : poses) {
    EXPECT_FALSE(image("out/keyframes/" + formatSeconds(pose.t_ns) + "/depth.tiff").empty());
  }

  const json report = reportIn("out");
  const json& events = report["events"];
  EXPECT_EQ(events["read"], recording.totalEvents());
  const auto sum = [](const json& counts) {
    std::uint64_t total = 0;
    for (const char* key : {"used", "without_pose", "outside_window", "dropped", "filtered",
                            "outside_lens", "over_budget"}) {
      total += counts[key].get<std::uint64_t>();
    }
    return total;
  };
  EXPECT_EQ(events["read"], sum(events));
  ASSERT_EQ(events["cameras"].size(), 2U);
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_EQ(events["cameras"][c]["read"], recording.events[c].size());
    EXPECT_EQ(events["cameras"][c]["read"], sum(events["cameras"][c]));
  }
  const json& votes = report["votes"];
  EXPECT_EQ(votes["cast"].get<std::uint64_t>() + votes["interpolated"].get<std::uint64_t>() +
                votes["outside_view"].get<std::uint64_t>() +
                votes["behind_camera"].get<std::uint64_t>(),
            report["event_uses"].get<std::uint64_t>() * 30);
  EXPECT_GT(report["event_uses"], events["used"]) << "windows overlap";
  EXPECT_GT(report["votes_per_second"], 0);
  EXPECT_GT(report["seconds"]["total"], report["seconds"]["sweep"]);
  EXPECT_EQ(report["options"]["dsi"]["num_planes"], 30);
  EXPECT_EQ(report["reference_view"]["fx"], 100);
  EXPECT_NEAR(report["baseline_m"], 0.1, 1e-9);
}

TEST_F(MapCommand, BadKeyframesCanBeLeftOutAndTheChecksSwitchedOff) {
  SyntheticRecording recording;
  write(recording);
  const std::string map = "map rig.ini data --out out --force ";
  ASSERT_EQ(run(map).status, 0);
  const json quality = reportIn("out")["quality"];
  EXPECT_EQ(quality["left_out"], 0);
  ASSERT_EQ(quality["keyframes"].size(), 4U);
  const Result none = run(map + "--set map.min_keyframe_quality=1");
  EXPECT_EQ(none.status, 1);
  EXPECT_THAT(none.err, HasSubstr("no-points: "));
  EXPECT_EQ(reportIn("out")["quality"]["left_out"], 4);
  const Result unchecked = run(map + "--set checks.enabled=false --strict");
  EXPECT_EQ(unchecked.status, 0) << unchecked.err;
  EXPECT_EQ(reportIn("out")["quality"]["word"], "unknown");
}

TEST_F(MapCommand, TheMaximaOfTheSavedDsiAreTheConfidences) {
  write(SyntheticRecording());
  const Result result =
      run("depth rig.ini data --out out --t0 10.1 --t1 10.3 --save-dsi --set dsi.num_planes=auto "
          "--set dsi.min_depth_m=0.05");
  ASSERT_EQ(result.status, 0) << result.err;
  const json report = reportIn("out");
  const std::size_t planes = report["options"]["dsi"]["num_planes"];
  ASSERT_NE(planes, 100U) << "not the placeholder";
  const cv::Mat depth = image("out/depth.tiff");
  EXPECT_EQ(depth.type(), CV_32F);
  EXPECT_EQ(report["points"], cv::countNonZero(depth));
  EXPECT_EQ(report["keyframes"], 1);

  const cv::Mat probability = image("out/probability.tiff");
  EXPECT_EQ(cv::countNonZero((probability > 0) != (depth > 0)), 0);

  const cv::Mat1f confidence = image("out/confidence.tiff");
  const std::string npy = contentOf("out/dsi.npy");
  EXPECT_THAT(npy.substr(0, 128), HasSubstr("'shape': (" + std::to_string(planes) + ", "));
  const std::size_t pixels = confidence.total();
  std::vector<float> dsi(pixels * planes);
  ASSERT_EQ(npy.size() % 64, dsi.size() * sizeof(float) % 64);
  std::memcpy(dsi.data(), npy.data() + npy.size() - dsi.size() * sizeof(float),
              dsi.size() * sizeof(float));
  for (std::size_t i = 0; i < pixels; ++i) {
    float largest = 0;
    for (std::size_t plane = 0; plane < planes; ++plane) {
      largest = std::max(largest, dsi[plane * pixels + i]);
    }
    ASSERT_EQ(largest, reinterpret_cast<const float*>(confidence.data)[i]) << "pixel " << i;
  }
}

TEST_F(MapCommand, NamesThatAreNotUtf8CostNoResult) {
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

TEST_F(MapCommand, MapRecordingMakesTheSameFilesAndReportsTheSameErrors) {
  write(SyntheticRecording());
  const auto files = [&](const std::string& name) {
    std::set<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(folder() / name)) {
      names.insert(fs::relative(entry.path(), folder() / name).string());
    }
    return names;
  };
  ASSERT_EQ(run("map rig.ini data --out out").status, 0);
  Options options;
  options.read(folder() / "rig.ini");
  const Report report = mapRecording({folder() / "data"}, folder() / "by_engine", options);
  EXPECT_EQ(files("by_engine"), files("out"));
  for (const char* name : {"map.pcd", "trajectory.txt"}) {
    EXPECT_EQ(contentOf(std::string("by_engine/") + name), contentOf(std::string("out/") + name));
  }
  EXPECT_EQ(report.keyframes, reportIn("out")["keyframes"]);
  EXPECT_EQ(report.points, reportIn("out")["points"]);
  EXPECT_EQ(json::parse(report.json)["options"], reportIn("out")["options"]);

  // A missing file is named.
  Overrides missing;
  missing.calibration = "none.yaml";
  for (const std::string& text :
       {messageOf([&] { openRecording({folder() / "data"}, missing); }),
        messageOf([&] { mapRecording({folder() / "data"}, folder() / "x", {}, missing); })}) {
    EXPECT_EQ(text, "Overrides::calibration none.yaml: no such file");
  }

  // Damage: what comes before it is mapped, then the error is thrown.
  std::ofstream(folder() / "data/cam0/events.txt", std::ios::app) << "damage\n";
  const Result damaged = run("map rig.ini data --out out");
  const std::string error =
      messageOf([&] { mapRecording({folder() / "data"}, folder() / "by_engine", options); });
  EXPECT_THAT(error, HasSubstr("Overrides::event_columns, - for one to ignore"));
  const std::size_t at = error.find("events.txt");
  EXPECT_THAT(damaged.err, HasSubstr(error.substr(at, error.find("Overrides") - at)));
  EXPECT_THAT(error,
              HasSubstr(damaged.err.substr(damaged.err.find("; events were read until"), 40)));
  EXPECT_EQ(contentOf("by_engine/map.pcd"), contentOf("out/map.pcd"));
}

}  // namespace
}  // namespace efm
