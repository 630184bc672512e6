// SPDX-License-Identifier: BSD-3-Clause
// `event-fusion map` and `depth` as a user runs them.

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "mapping/geometry/trajectory.h"
#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class MapCommand : public AppTest {};

TEST_F(MapCommand, WritesTheFilesOfTheContract) {
  write(SyntheticRecording());

  const Result result = run("map rig.ini data --out out");

  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.err, IsEmpty()) << "quiet when not on a terminal";
  EXPECT_THAT(result.out, AllOf(HasSubstr("keyframes   4\n"), HasSubstr("out: map.html, map.pcd")));
  const auto files = filesIn("out");
  EXPECT_EQ(files.size(), 7U + 4 * 4) << testing::PrintToString(files);
  EXPECT_THAT(files, testing::IsSupersetOf({"map.html", "map.pcd", "map.png", "map.simplemap",
                                            "overview.png", "report.json", "trajectory.txt"}));
  const auto poses = readTumTrajectory(folder() / "out" / "trajectory.txt");
  ASSERT_EQ(poses.size(), 4U);
  for (const StampedPose& pose : poses) {
    const auto keyframe = folder() / "out" / "keyframes" / formatSeconds(pose.t_ns);
    EXPECT_TRUE(exists(keyframe / "depth.tiff")) << keyframe;
    EXPECT_TRUE(exists(keyframe / "confidence.png")) << keyframe;
  }
}

TEST_F(MapCommand, QuietCommandsSayNothingAndVerboseOnesALinePerKeyframe) {
  write(SyntheticRecording());
  for (const std::string command :
       {"import data --out data.rawlog", "export data --to folder --out copy", "info data",
        "map rig.ini data --out out", "depth rig.ini data --out depth --t0 10.1 --t1 10.3",
        "simulate --preset desk_stereo --duration 0.01 --out simulated"}) {
    const Result result = run(command + " --quiet");
    EXPECT_EQ(result.status, 0) << command;
    EXPECT_EQ(result.out + result.err, "") << command;
  }
  const Result result = run("map rig.ini data --out out -v");
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 4);
  EXPECT_THAT(result.err, HasSubstr("keyframe 1 at 10.102000000 s (+0.1 s): 639 events, "));
  EXPECT_NE(run("map rig.ini data --out out -v -q").status, 0);
}

TEST_F(MapCommand, CountsOfTheReportAddUp) {
  const SyntheticRecording recording;
  write(recording);
  ASSERT_EQ(run("map rig.ini data --out out").status, 0);

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
  EXPECT_EQ(votes["cast"].get<std::uint64_t>() + votes["outside_view"].get<std::uint64_t>() +
                votes["behind_camera"].get<std::uint64_t>(),
            report["event_uses"].get<std::uint64_t>() * 30);
  EXPECT_GT(report["event_uses"], events["used"]) << "windows overlap";
  EXPECT_GT(report["votes_per_second"], 0);
  EXPECT_GT(report["seconds"]["total"], report["seconds"]["sweep"]);
  EXPECT_EQ(report["options"]["dsi"]["num_planes"], 30);
  EXPECT_EQ(report["reference_view"]["fx"], 100);
  EXPECT_NEAR(report["baseline_m"], 0.1, 1e-9);
}

TEST_F(MapCommand, ThreadsDoNotChangeAByteOfTheMap) {
  write(SyntheticRecording());
  ASSERT_EQ(run("map rig.ini data --out one --set performance.threads=1").status, 0);
  ASSERT_EQ(run("map rig.ini data --out two --set performance.threads=2").status, 0);

  const auto files = filesIn("one");
  ASSERT_EQ(files, filesIn("two"));
  for (const std::string& file : files) {
    if (file == "report.json" || file == "map.html") continue;  // they have times
    EXPECT_EQ(contentOf(folder() / "one" / file), contentOf(folder() / "two" / file)) << file;
  }
}

TEST_F(MapCommand, ARawlogGivesTheSameMapAsTheFolder) {
  write(SyntheticRecording());
  ASSERT_EQ(run("import data --out r.rawlog").status, 0);
  ASSERT_EQ(run("map rig.ini data --out one").status, 0);
  ASSERT_EQ(run("map rig.ini r.rawlog --out two").status, 0);
  EXPECT_EQ(contentOf("one/map.pcd"), contentOf("two/map.pcd"));
}

// --- Bad input -------------------------------------------------------------------------------

TEST_F(MapCommand, TimesMayCountFromTheFirstEvent) {
  write(SyntheticRecording());
  const std::int64_t start_ns = SyntheticRecording().events[0].front().t_ns;
  const std::string absolute = " --t0 " + formatSeconds(start_ns + 100'000'000) + " --t1 " +
                               formatSeconds(start_ns + 400'000'000);
  const std::string map = mapOf("data" + absolute);
  EXPECT_EQ(mapOf("data --t0 +0.1 --t1 +0.4"), map);
  EXPECT_EQ(mapOf("data --t0 +0.1 --duration 0.3"), map);
  EXPECT_EQ(run("depth rig.ini data --out one" + absolute).status, 0);
  EXPECT_EQ(run("depth rig.ini data --out two --t0 +0.1 --duration 0.3 --ref-time +0.25").status,
            0);
  EXPECT_EQ(contentOf("two/depth.tiff"), contentOf("one/depth.tiff"));
  EXPECT_THAT(errorOf("depth rig.ini data --out one --t0 1"), HasSubstr("--t1"));
  EXPECT_THAT(errorOf("map rig.ini data --out out --duration -1"), HasSubstr("--duration"));
}

TEST_F(MapCommand, ASignalEndsItWithTheMapSoFar) {
  write(SyntheticRecording(4.0));  // 400 keyframes: it cannot end before the signal
  const Result result = interrupted("map rig.ini data --out out --set keyframes.stride_s=0.01",
                                    [this] { return exists(folder() / "out" / "keyframes"); });
  EXPECT_EQ(result.status, 130);
  const json report = reportIn("out");
  EXPECT_LE(report["stopped_at"], 1) << "a small file is read at once";
  const std::string percent = std::to_string(std::lround(100 * report["stopped_at"].get<double>()));
  EXPECT_THAT(result.out, HasSubstr("of recording, stopped at " + percent + " %"));
  EXPECT_THAT(result.err, HasSubstr("event-fusion: stopped at " + percent + " % of the recording"));
  const std::size_t keyframes = report["keyframes"];
  EXPECT_GT(keyframes, 0U);
  EXPECT_EQ(posesIn("out").size(), keyframes);
  EXPECT_EQ(filesIn("out").size(), 7 + 4 * keyframes);
}

TEST_F(MapCommand, ARunWithoutKeyframesKeepsTheEarlierMap) {
  write(SyntheticRecording());
  ASSERT_EQ(run("map rig.ini data --out out").status, 0);
  const auto files = filesIn("out");
  std::ofstream(folder() / "text.rawlog") << "no rawlog";
  for (const char* arguments :
       {"map nowhere.ini data", "map rig.ini nowhere", "map rig.ini text.rawlog",
        "map rig.ini data --set dsi.num_planes=0", "map rig.ini data --set rig.cameras=0,5"}) {
    EXPECT_NE(run(std::string(arguments) + " --out out").status, 0) << arguments;
    EXPECT_EQ(filesIn("out"), files) << arguments;
    EXPECT_EQ(reportIn("out")["keyframes"], 4) << arguments;
  }
}

TEST_F(MapCommand, ARunThatCannotWriteItsResultLeavesTheEarlierOne) {
  write(SyntheticRecording());
  const auto contents = [this](const std::string& out) {
    std::map<std::string, std::string> files;
    for (const std::string& file : filesIn(out)) files[file] = contentOf(out + "/" + file);
    return files;
  };
  const std::string map = "map rig.ini data --out map --set keyframes.stride_s=";
  const std::string depth = "depth rig.ini data --out depth --save-dsi --t0 10.1 --t1 10.";
  ASSERT_EQ(run(map + "0.1").status, 0);
  ASSERT_EQ(run(depth + "3").status, 0);
  const auto earlier_map = contents("map");
  const auto earlier_depth = contents("depth");
  const auto keeps = [&](const std::string& command, const std::string& limit) {
    const Result result = shell(limit + "'" EFM_EVENT_FUSION "' " + command);
    EXPECT_EQ(result.status, 1) << command;
    EXPECT_EQ(result.out, "") << command;
    const bool is_map = command.rfind("map", 0) == 0;
    EXPECT_THAT(result.err, HasSubstr("; the earlier result in " +
                                      std::string(is_map ? "map" : "depth") + " stays\n"));
    EXPECT_TRUE(contents("map") == earlier_map) << testing::PrintToString(filesIn("map"));
    EXPECT_TRUE(contents("depth") == earlier_depth) << testing::PrintToString(filesIn("depth"));
    const auto folders = std::filesystem::directory_iterator(folder() / "map" / "keyframes");
    EXPECT_EQ(std::distance(begin(folders), end(folders)), 4) << command;
    return result.err;
  };
  // Units of 512 bytes. The first picture, and one of the last files.
  EXPECT_THAT(keeps(map + "0.05", "ulimit -f 4; "), HasSubstr(".tiff: the file would be larger"));
  EXPECT_THAT(keeps(map + "0.05", "ulimit -f 128; "), HasSubstr("map.png: the file would be"));
  EXPECT_THAT(keeps(depth + "4", "ulimit -f 4; "), HasSubstr(".tiff: the file would be larger"));
  EXPECT_THAT(keeps(depth + "4", "ulimit -f 128; "), HasSubstr("dsi.npy"));

  ASSERT_EQ(run(map + "0.05").status, 0);
  EXPECT_EQ(reportIn("map")["keyframes"], 7);
  EXPECT_EQ(filesIn("map").size(), 7U + 4 * 7);
  ASSERT_EQ(run(depth + "4").status, 0);
  EXPECT_NE(contentOf("depth/dsi.npy"), earlier_depth.at("dsi.npy"));
  EXPECT_EQ(filesIn("depth").size(), 7U);

  // A folder that it cannot write to.
  std::filesystem::remove_all(folder() / "map" / "keyframes");
  write("map/keyframes", "mine");
  const auto without_keyframes = contents("map");
  EXPECT_THAT(errorOf(map + "0.1"), HasSubstr("map/keyframes"));
  EXPECT_TRUE(contents("map") == without_keyframes) << testing::PrintToString(filesIn("map"));
}

TEST_F(MapCommand, AFolderHoldsTheFilesOfOneRun) {
  write(SyntheticRecording());
  const std::string depth = "depth rig.ini data --out out --t0 10.1 --t1 10.3";
  ASSERT_EQ(run("map rig.ini data --out out").status, 0);
  const auto map_files = filesIn("out");
  EXPECT_THAT(errorOf(depth), HasSubstr("out: holds the result of `map`: expected another folder"));
  EXPECT_EQ(filesIn("out"), map_files);
  ASSERT_EQ(run(depth + " --force").status, 0);
  EXPECT_EQ(filesIn("out").size(), 6U) << testing::PrintToString(filesIn("out"));
  EXPECT_THAT(errorOf("map rig.ini data --out out"), HasSubstr("holds the result of `depth`"));
  ASSERT_EQ(run("map rig.ini data --out out --force").status, 0);
  EXPECT_EQ(filesIn("out"), map_files);
}

TEST_F(MapCommand, AResultReplacesNoInputAndNoForeignFile) {
  write(SyntheticRecording());
  ASSERT_EQ(run("import data --out r.rawlog").status, 0);
  const auto in_out = [&](const char* from, const char* to) {
    std::filesystem::remove_all(folder() / "out");
    std::filesystem::create_directory(folder() / "out");
    if (std::string(from).empty()) {
      std::ofstream(folder() / "out" / to) << "{}";
    } else {
      std::filesystem::copy_file(folder() / from, folder() / "out" / to);
    }
  };
  const struct {
    const char* from;
    const char* to;
    std::string command;
    const char* words;
  } cases[] = {
      {"data/poses.txt", "trajectory.txt", "map rig.ini data --poses out/trajectory.txt",
       "out: it holds the input out/trajectory.txt itself"},
      {"r.rawlog", "map.simplemap", "map rig.ini out/map.simplemap", "out: it holds the input"},
      {"r.rawlog", "map.simplemap", "map rig.ini ./out", "out: it is the input ./out itself"},
      {"data/camchain.yaml", "report.json", "map rig.ini data --calibration out/report.json",
       "out: it holds the input out/report.json"},
      {"data/camchain.yaml", "depth.png",
       "depth rig.ini data --t0 10.1 --t1 10.3 --set rig.calibration=out/depth.png",
       "out: it holds the input out/depth.png"},
      {"rig.ini", "map.html", "map --config out/map.html data", "out: it holds the input"},
  };
  for (const auto& [from, to, command, words] : cases) {
    in_out(from, to);
    for (const char* force : {"", " --force"}) {
      EXPECT_THAT(errorOf(command + " --out out" + force), HasSubstr(words));
      EXPECT_EQ(contentOf(std::string("out/") + to), contentOf(from)) << command;
      EXPECT_EQ(filesIn("out").size(), 1U) << command;
    }
  }
  std::filesystem::remove_all(folder() / "out");
  std::filesystem::create_directory(folder() / "out");
  std::filesystem::create_symlink("../r.rawlog", folder() / "out" / "map.pcd");
  EXPECT_THAT(errorOf("map rig.ini r.rawlog --out out --force"),
              HasSubstr("out/map.pcd: it is the input r.rawlog itself"));
  for (const char* foreign : {"trajectory.txt", "report.json", "depth.png"}) {
    in_out("", foreign);
    EXPECT_THAT(errorOf("map rig.ini data --out out"), HasSubstr("out: holds other files"));
    EXPECT_EQ(contentOf(std::string("out/") + foreign), "{}");
  }
}

TEST_F(MapCommand, ASilentCameraIsAWarning) {
  SyntheticRecording recording;
  recording.events[1].clear();
  write(recording);
  const Result result = run("map rig.ini data --out out");
  EXPECT_EQ(result.status, 1) << "the map has no point";
  EXPECT_THAT(result.err,
              AllOf(HasSubstr("event-fusion: warning: silent-camera: camera 1 has no event"),
                    HasSubstr("warning: silent-keyframes: camera 1 had no event in 4 of 4 keyfr")));
}

TEST_F(MapCommand, WarningsHaveNamesAndByOptionAreErrors) {
  SyntheticRecording recording;
  for (StampedPose& pose : recording.poses) pose.T_world_rig.translation.setZero();
  write(recording);
  const auto warned = HasSubstr("event-fusion: warning: no-motion: the poses move by at most 0 m");
  const auto error = HasSubstr("event-fusion: error: 1 warnings, and --strict makes them errors");
  for (const std::string command : {"map rig.ini data --out out", "info data",
                                    "depth rig.ini data --out out2 --t0 10.1 --t1 10.4"}) {
    const Result result = run(command);
    EXPECT_EQ(result.status, 0) << command;
    EXPECT_THAT(result.err, AllOf(warned, Not(error))) << command;
  }
  for (const std::string out : {"out", "out2"}) {
    const json warnings = reportIn(out)["warnings"];
    ASSERT_EQ(warnings.size(), 1U) << warnings;
    EXPECT_EQ(warnings[0]["name"], "no-motion");
    EXPECT_THAT(warnings[0]["text"].get<std::string>(), HasSubstr("at most 0 m"));
  }
  for (const std::string command : {"map rig.ini data --out strict", "info data",
                                    "depth rig.ini data --out strict2 --t0 10.1 --t1 10.4"}) {
    const Result result = run(command + " --strict");
    EXPECT_EQ(result.status, 1) << command;
    EXPECT_THAT(result.err, AllOf(warned, error)) << command;
  }
  EXPECT_EQ(filesIn("strict"), filesIn("out"));
  EXPECT_EQ(filesIn("strict2"), filesIn("out2"));
}

TEST_F(MapCommand, DepthsAtALimitAndMapsWithoutPointsAreWarnings) {
  write(SyntheticRecording());  // at 2 m
  for (const std::string command :
       {"map rig.ini data --out out", "depth rig.ini data --out out2 --t0 10.1 --t1 10.3"}) {
    const Result result = run(command + " --set depth.min_quality=1e6");
    EXPECT_THAT(result.err, AllOf(HasSubstr("warning: no-points: the map has no point"),
                                  HasSubstr("event-fusion: error: the map has no point")));
    EXPECT_EQ(result.status, 1) << "the job is not done";
  }
  ASSERT_EQ(run("map rig.ini data --out full").status, 0);
  EXPECT_EQ(filesIn("out"), filesIn("full")) << "everything is written";
  const std::string at_limit =
      " --set dsi.max_depth_m=2 --set dsi.num_planes=100 --set depth.extraction=paper";
  EXPECT_THAT(run("map rig.ini data --out out" + at_limit).err,
              AllOf(HasSubstr("warning: depths-at-limit: "), Not(HasSubstr("no-points"))));
}

// --- depth -----------------------------------------------------------------------------------

TEST_F(MapCommand, DepthWritesOneKeyframeStraightIntoTheFolder) {
  write(SyntheticRecording());
  const Result result = run("depth rig.ini data --out out --t0 10.1 --t1 10.3 --save-dsi");
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(filesIn("out"),
              testing::ElementsAre("confidence.png", "confidence.tiff", "depth.png", "depth.tiff",
                                   "dsi.npy", "points.pcd", "report.json"));
  const cv::Mat depth =
      cv::imread((folder() / "out" / "depth.tiff").string(), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(depth.type(), CV_32F);
  EXPECT_EQ(reportIn("out")["points"], cv::countNonZero(depth));
  EXPECT_EQ(reportIn("out")["keyframes"], 1);
}

TEST_F(MapCommand, TheMaximaOfTheSavedDsiAreTheConfidences) {
  write(SyntheticRecording());
  ASSERT_EQ(run("depth rig.ini data --out out --t0 10.1 --t1 10.3 --save-dsi").status, 0);
  const cv::Mat1f confidence =
      cv::imread((folder() / "out" / "confidence.tiff").string(), cv::IMREAD_UNCHANGED);
  const std::string npy = contentOf("out/dsi.npy");
  const std::size_t pixels = confidence.total();
  ASSERT_EQ(npy.size() % 64, pixels * 30 * sizeof(float) % 64);
  const std::size_t header = npy.size() - pixels * 30 * sizeof(float);
  std::vector<float> dsi(pixels * 30);
  std::memcpy(dsi.data(), npy.data() + header, dsi.size() * sizeof(float));
  for (std::size_t i = 0; i < pixels; ++i) {
    float largest = 0;
    for (std::size_t plane = 0; plane < 30; ++plane) {
      largest = std::max(largest, dsi[plane * pixels + i]);
    }
    ASSERT_EQ(largest, reinterpret_cast<const float*>(confidence.data)[i]) << "pixel " << i;
  }
}

TEST_F(MapCommand, TheSavedDsiHasTheChosenPlanes) {
  write(SyntheticRecording());
  const std::string automatic = " --set dsi.num_planes=auto --set dsi.min_depth_m=0.05";
  ASSERT_EQ(run("depth rig.ini data --out out --t0 10.1 --t1 10.3 --save-dsi" + automatic).status,
            0);
  const nlohmann::json planes = reportIn("out")["options"]["dsi"]["num_planes"];
  ASSERT_NE(planes, 100) << "not the placeholder";
  EXPECT_THAT(contentOf("out/dsi.npy").substr(0, 128),
              HasSubstr("'shape': (" + std::to_string(planes.get<int>()) + ", "));
}

TEST_F(MapCommand, DepthUsesTheGivenReferenceTime) {
  write(SyntheticRecording());
  ASSERT_EQ(run("depth rig.ini data --out a --t0 10.1 --t1 10.3").status, 0);
  ASSERT_EQ(run("depth rig.ini data --out b --t0 10.1 --t1 10.3 --ref-time 10.2").status, 0);
  ASSERT_EQ(run("depth rig.ini data --out c --t0 10.1 --t1 10.3 --ref-time 10.3").status, 0);
  EXPECT_EQ(contentOf("a/depth.tiff"), contentOf("b/depth.tiff"));
  EXPECT_NE(contentOf("a/depth.tiff"), contentOf("c/depth.tiff"));
}

}  // namespace
}  // namespace efm
