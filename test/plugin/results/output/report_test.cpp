// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <functional>
#include <tuple>

#include "plugin/options/option_keys.h"
#include "plugin/results/output/report.h"

namespace efm {
namespace {

using nlohmann::json;

RunReport smallReport() {
  RunReport report;
  report.counts.cameras = {{10, 6, 1, 1, 1, 0, 0, 1}, {5, 5}};
  report.counts.event_uses = 20;
  report.counts.votes = {1500, 50, 400, 100};
  report.counts.keyframes = 2;
  report.points = 7;
  report.times.real = {9, 1, 0.25, 1.5, 2.5, 2, 0.5, 0, 1.5};
  report.times.cpu = {100, 1, 11, 0.5, 1.5, 3, 2, 4, 5, 6, 7, 8, 9, 10};
  report.options.mapper.keyframe.sweep.threads = 3;
  return report;
}

TEST(Report, ListsThePerturbationOfPoses) {
  RunReport report = smallReport();
  EXPECT_FALSE(json::parse(reportJson(report)).contains("perturbation"));
  report.faults.latency_ns = 200'000'000;
  report.faults.perturbation.seed = 9;
  const json perturbation = json::parse(reportJson(report))["perturbation"];
  EXPECT_EQ(perturbation["latency_s"], 0.2);
  EXPECT_EQ(perturbation["noise_m"], 0);
  EXPECT_EQ(perturbation["seed"], 9);
  EXPECT_FALSE(perturbation.contains("keyframe_s"));
}

TEST(Report, TotalsAreTheSumsOfTheCamerasAndVotesPerSecondAreOverTheSweepsSeconds) {
  const json report = json::parse(reportJson(smallReport()));
  EXPECT_EQ(report["events"]["read"], 15);
  EXPECT_EQ(report["events"]["used"], 11);
  EXPECT_EQ(report["events"]["filtered"], 1);
  EXPECT_DOUBLE_EQ(report["votes_per_second"], 500);  // (1500 + 400 + 100) / 4
  EXPECT_EQ(json::parse(reportJson({}))["votes_per_second"], 0);
}

/// @param expected some keys and their values.
void expectKeys(const json& written, const char* expected) {
  const json keys = json::parse(expected);
  for (const auto& [key, value] : keys.items()) EXPECT_EQ(written[key], value) << key;
}

TEST(Report, EveryCountHasItsOwnKey) {
  RunReport report = smallReport();
  MapperCounts& counts = report.counts;
  counts.cameras = {{96, 11, 7, 8, 12, 9, 15, 10, 6, 18}};
  counts.keyframes_without_pose = 12;
  counts.windows_without_events = 13;
  counts.silent_subintervals = 14;
  counts.sorted_events = 15;
  counts.duplicate_poses = 16;
  report.skipped_events = 3;
  report.silent_keyframes = {0, 17};
  report.recording_s = 2.5;
  report.peak_memory_bytes = 123;
  report.extent = MapExtent{{1, 2, 3}, {4, 5, 6}};
  report.most_extent = MapExtent{{1, 2, 3}, {4, 5, 5}};
  const json written = json::parse(reportJson(report));
  EXPECT_EQ(written["events"]["cameras"], json::array({json::parse(R"({"read": 96, "used": 11,
      "without_pose": 7, "outside_window": 8, "late": 12, "dropped": 9, "unselected": 15,
      "filtered": 10, "outside_lens": 6, "over_budget": 18})")}));
  expectKeys(written, R"({
      "votes": {"cast": 1500, "interpolated": 50, "outside_view": 400, "behind_camera": 100},
      "seconds": {"total": 9, "read": 1, "look": 0.25, "sweep": 4, "depth": 2, "motion": 0.5, "refine": 0,
        "map": 1.5},
      "cpu_seconds": {"total": 100,
        "once": {"start": 8, "look": 11, "tables": 9, "output": 10},
        "events": {"read": 1, "filter": 6},
        "keyframes": {"sweep": 2, "depth": 3, "motion": 2, "refine": 4, "map": 5, "images": 7},
        "other": 32},
      "schema": 1, "event_uses": 20, "keyframes": 2, "keyframes_without_pose": 12,
      "windows_without_events": 13, "silent": {"subintervals": 14, "keyframes": [0, 17]},
      "sorted_events": 15, "skipped_events": 3, "duplicate_poses": 16, "points": 7,
      "recording_seconds": 2.5, "peak_memory_bytes": 123,
      "extent_m": {"min": [1, 2, 3], "max": [4, 5, 6]},
      "most_extent_m": {"min": [1, 2, 3], "max": [4, 5, 5]}})");
}

TEST(Report, ErrorsOfTheTrackerAreInMetresAndDegrees) {
  RunReport report = smallReport();
  EXPECT_FALSE(json::parse(reportJson(report)).contains("refinement"));
  report.refinement.emplace();
  report.refinement->counts = {1, 2, 3, 4, 5};
  report.refinement->failures = 6;
  report.refinement->last_error = "no memory";
  report.refinement->tracker = {0.5, M_PI / 180, 0.25, 2 * M_PI / 180};
  report.pose_shift = PoseShift{0.5, 0.75, M_PI / 180, 2 * M_PI / 180};
  const json written = json::parse(reportJson(report))["refinement"];
  expectKeys(written, R"({"registered": 1, "loop_checks": 2, "loops": 3, "loops_dropped": 4,
      "failed_solves": 5, "failures": 6, "last_error": "no memory"})");
  for (const auto& [group, key, expected] : {std::tuple("moved", "median_m", 0.5),
                                             {"moved", "max_m", 0.75},
                                             {"moved", "median_deg", 1.0},
                                             {"moved", "max_deg", 2.0},
                                             {"tracker", "noise_m", 0.5},
                                             {"tracker", "noise_deg", 1.0},
                                             {"tracker", "drift", 0.25},
                                             {"tracker", "drift_deg_per_m", 2.0}}) {
    EXPECT_NEAR(written[group][key].get<double>(), expected, 1e-12) << key;
  }
}

TEST(Report, OptionsHaveTheKeysOfFilesAndTheirTypes) {
  const RunReport report = smallReport();
  const json written = json::parse(reportJson(report));
  for (const char* key : {"kernel", "threads", "version"}) EXPECT_TRUE(written.contains(key));
  const json options = written["options"];
  std::size_t keys = 0;
  for (const auto& section : options) keys += section.size();
  EXPECT_EQ(keys, listOptions(report.options).size());
  EXPECT_EQ(options["dsi"]["num_planes"], 100);
  EXPECT_EQ(options["dsi"]["min_depth_m"], 0.5);
  EXPECT_EQ(options["depth"]["subplane"], true);
  EXPECT_EQ(options["depth"]["max_confidence"], "keyframe");
  EXPECT_EQ(options["fusion"]["across_cameras"], "pairs");
  EXPECT_EQ(options["performance"]["threads"], 3);
}

TEST(Report, PeakMemoryIsThatOfAProcess) { EXPECT_GT(peakMemoryBytes(), 1U << 20); }

RunReport usualReport() {
  RunReport report;
  report.counts.cameras.resize(1);
  report.counts.cameras[0].read = 1000;
  report.counts.cameras[0][EventFate::kUsed] = 1000;
  report.counts.keyframes = 31;
  report.points = 48210;
  report.times.real.total = 21.2;
  report.recording_s = 60.1;
  report.peak_memory_bytes = 812'345'678;
  return report;
}

TEST(Summary, OfAUsualMapIsShort) {
  EXPECT_EQ(
      summaryOf(usualReport(), OutputKind::kMap, "out"),
      "keyframes   31\n"
      "points      48210\n"
      "events      100.0 % of 1000 used\n"
      "time        21 s for 1:00 min of recording; at most 812 MB of memory\n"
      "results     out: map.html, map.pcd, keyframes/*/depth.png, trajectory.txt, report.json\n");
}

TEST(Summary, OfADepthMapHasNoKeyframesAndItsOwnFiles) {
  EXPECT_EQ(summaryOf(usualReport(), OutputKind::kDepth, "one"),
            "points      48210\n"
            "events      100.0 % of 1000 used\n"
            "time        21 s for 1:00 min of recording; at most 812 MB of memory\n"
            "results     one: points.pcd, depth.tiff, depth.png, report.json\n");
}

TEST(Summary, EachFactHasItsLine) {
  const std::pair<std::function<void(RunReport&)>, const char*> cases[] = {
      {[](RunReport& report) {
         report.most_extent = MapExtent{{-1.2, 0, -100}, {3.054, 0.5, -99.5}};
         report.extent = MapExtent{{-9, -9, -900}, {9, 9, 900}};
       },
       "extent      4.25 x 0.50 x 0.50 m: x -1.20 to 3.05, y 0.00 to 0.50, z -100.00 to -99.50\n"},
      {[](RunReport& report) {
         report.counts.cameras[0] = {12'345'678, 0, 0, 12'345'678};
       },
       "events      under 0.1 % of 12.3 million used; 100.0 % outside the keyframes' windows\n"},
      {[](RunReport& report) {
         report.counts.cameras[0] = {1000, 400, 10, 20, 25, 30, 15, 40, 160, 300};
       },
       "events      40.0 % of 1000 used; 2.0 % outside the keyframes' windows, 1.0 % without a "
       "pose, 4.0 % filtered as noise, 30.0 % over max_events_per_camera, 2.5 % too late, 3.0 % in "
       "dropped windows, 1.5 % of cameras that are not selected, 16.0 % outside the lens model\n"},
      {[](RunReport& report) {
         report.counts.cameras.push_back(report.counts.cameras[0]);
         report.counts.cameras[1][EventFate::kUsed] = 0;
       },
       "events      50.0 % of 2000 used\n"},
      {[](RunReport& report) { report.stopped_at = 0.432; },
       "time        21 s for 1:00 min of recording, stopped at 43 %; at most 812 MB of memory\n"},
      {[](RunReport& report) {
         report.times.real.total = 0.44;
         report.recording_s = 7200;
       },
       "time        0.4 s for 02:00 h of recording; at most 812 MB of memory\n"},
      {[](RunReport& report) {
         report.pose_shift = PoseShift{0.012, 0.5, M_PI / 180, M_PI / 18};
       },
       "refinement  moved the poses by 1.20 cm and 1.00 degrees (median), at most 50.00 cm and "
       "10.00 degrees\n"},
      {[](RunReport& report) { report.refinement.emplace(); },
       "results     out: map.html, map.pcd, keyframes/*/depth.png, trajectory.txt, "
       "trajectory_tracker.txt, report.json\n"},
      {[](RunReport& report) {
         report.warnings = {{"a", "b"}, {"c", "d"}};
       },
       "warnings    2, on stderr and in report.json\n"}};
  for (const auto& [change, line] : cases) {
    RunReport report = usualReport();
    change(report);
    EXPECT_THAT(summaryOf(report, OutputKind::kMap, "out"), testing::HasSubstr(line));
  }
}

TEST(Summary, MeasuresOfTheMapAreItsBoxAndThePosesShift) {
  EXPECT_FALSE(extentOf(MapCloud()));
  const auto extent =
      extentOf(*mapCloudOf({{{1, 5, -3}, 1, 1}, {{2, 4, -3}, 1, 1}, {{0, 6, -2}, 1, 1}}, 0.01));
  ASSERT_TRUE(extent);
  EXPECT_EQ(extent->min_m, Eigen::Vector3d(0, 4, -3));
  EXPECT_EQ(extent->max_m, Eigen::Vector3d(2, 6, -2));

  // 2001 points along x, 1 m apart. One point in a thousand lies far away on y and z.
  std::vector<CloudPoint> points;
  for (int i = 0; i <= 2000; ++i) {
    const bool is_far = i == 700 || i == 1400;
    points.push_back({{i - 500.0, is_far ? 1e4 : 0.001 * i, is_far ? -1e4 : 5}, 1});
  }
  RunReport report;
  describePoints(*mapCloudOf(points, 0.01), report);
  EXPECT_EQ(report.points, 2001U);
  EXPECT_EQ(report.extent->max_m, Eigen::Vector3d(1500, 1e4, 5));
  EXPECT_EQ(report.extent->min_m, Eigen::Vector3d(-500, 0, -1e4));
  EXPECT_EQ(report.most_extent->min_m.x(), -498);
  EXPECT_EQ(report.most_extent->max_m.x(), 1498);
  EXPECT_FLOAT_EQ(report.most_extent->max_m.y(), 2);
  EXPECT_EQ(report.most_extent->min_m.z(), 5);

  std::vector<StampedPose> before(3);
  std::vector<StampedPose> after(3);
  after[0].T_world_rig.translation = {3, 4, 0};
  after[1].T_world_rig.translation = {1, 0, 0};
  after[2].T_world_rig.rotation = rotationBy({0, 0.3, 0});
  const PoseShift shift = shiftBetween(before, after);
  EXPECT_DOUBLE_EQ(shift.median_m, 1);
  EXPECT_DOUBLE_EQ(shift.max_m, 5);
  EXPECT_DOUBLE_EQ(shift.median_rad, 0);
  EXPECT_NEAR(shift.max_rad, 0.3, 1e-12);  // accuracy of rounding
}

}  // namespace

}  // namespace efm
