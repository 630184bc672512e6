// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/output/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace efm {
namespace {

MapReport usualReport() {
  MapReport report;
  report.counts.cameras.resize(1);
  report.counts.cameras[0].read = 1000;
  report.counts.cameras[0].used = 1000;
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
  const std::pair<std::function<void(MapReport&)>, const char*> cases[] = {
      {[](MapReport& report) {
         report.most_extent = MapExtent{{-1.2, 0, -100}, {3.054, 0.5, -99.5}};
         report.extent = MapExtent{{-9, -9, -900}, {9, 9, 900}};
       },
       "extent      4.25 x 0.50 x 0.50 m: x -1.20 to 3.05, y 0.00 to 0.50, z -100.00 to -99.50\n"},
      {[](MapReport& report) {
         report.counts.cameras[0] = {12'345'678, 0, 0, 12'345'678};
       },
       "events      under 0.1 % of 12.3 million used; 100.0 % outside the keyframes' windows\n"},
      {[](MapReport& report) { report.counts.cameras[0] = {1000, 400, 10, 20, 30, 40, 200, 300}; },
       "events      40.0 % of 1000 used; 2.0 % outside the keyframes' windows, 1.0 % without a "
       "pose, "
       "4.0 % filtered as noise, 30.0 % over max_events_per_camera, 3.0 % too late, or of a camera "
       "that takes no part, 20.0 % outside the lens model\n"},
      {[](MapReport& report) {
         report.counts.cameras.push_back(report.counts.cameras[0]);
         report.counts.cameras[1].used = 0;
       },
       "events      50.0 % of 2000 used\n"},
      {[](MapReport& report) { report.stopped_at = 0.432; },
       "time        21 s for 1:00 min of recording, stopped at 43 %; at most 812 MB of memory\n"},
      {[](MapReport& report) {
         report.times.real.total = 0.44;
         report.recording_s = 7200;
       },
       "time        0.4 s for 02:00 h of recording; at most 812 MB of memory\n"},
      {[](MapReport& report) {
         report.pose_shift = PoseShift{0.012, 0.5, M_PI / 180, M_PI / 18};
       },
       "refinement  moved the poses by 1.20 cm and 1.00 degrees (median), at most 50.00 cm and "
       "10.00 degrees\n"},
      {[](MapReport& report) { report.refinement.emplace(); },
       "results     out: map.html, map.pcd, keyframes/*/depth.png, trajectory.txt, "
       "trajectory_tracker.txt, report.json\n"},
      {[](MapReport& report) {
         report.warnings = {{"a", "b"}, {"c", "d"}};
       },
       "warnings    2, on stderr and in report.json\n"}};
  for (const auto& [change, line] : cases) {
    MapReport report = usualReport();
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

  // 2001 points along x, 1 m apart; on y and z, one in a thousand lies far away.
  std::vector<CloudPoint> points;
  for (int i = 0; i <= 2000; ++i) {
    const bool is_far = i == 700 || i == 1400;
    points.push_back({{i - 500.0, is_far ? 1e4 : 0.001 * i, is_far ? -1e4 : 5}, 1});
  }
  MapReport report;
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
  EXPECT_NEAR(shift.max_rad, 0.3, 1e-12);  // rounding
}

}  // namespace
}  // namespace efm
