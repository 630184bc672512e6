// SPDX-License-Identifier: BSD-3-Clause
// Tests that the real slider in another format, on another clock and in other units
// (docs/your-data.md) gives the same map.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <iterator>
#include <sstream>
#include <string>

#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

const fs::path kSlider = EFM_SHARED_DATA "/slider_depth";

using OwnRecording = AppTest;

/// Returns a time of the slider, "0.003811000", in nanoseconds of a clock that began in 1970.
std::string nanosecondsOf(const std::string& seconds) {
  const std::size_t point = seconds.find('.');
  return std::to_string(1'600'000'000 + std::stoll(seconds.substr(0, point))) +
         seconds.substr(point + 1);
}

std::string eventsAsCsv() {
  std::ifstream lines(kSlider / "events.txt");
  std::string text;
  for (std::string t, x, y, p; lines >> t >> x >> y >> p;) {
    fmt::format_to(std::back_inserter(text), "{},{},{},{}\n", x, y, p == "1" ? "1" : "-1",
                   nanosecondsOf(t));
  }
  return text;
}

/// Returns the poses in millimetres; the quaternion's w comes first.
std::string posesAsCsv() {
  std::ifstream lines(kSlider / "groundtruth.txt");
  std::string text = "t_ns,qw,qx,qy,qz,x_mm,y_mm,z_mm\n";
  std::string t, qx, qy, qz, qw;
  for (double x = 0, y = 0, z = 0; lines >> t >> x >> y >> z >> qx >> qy >> qz >> qw;) {
    fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{}\n", nanosecondsOf(t), qw, qx,
                   qy, qz, 1000 * x, 1000 * y, 1000 * z);
  }
  return text;
}

std::string calibrationOfKalibr() {
  std::ifstream numbers(kSlider / "calib.txt");
  std::string fx, fy, cx, cy, k1, k2, p1, p2;
  numbers >> fx >> fy >> cx >> cy >> k1 >> k2 >> p1 >> p2;
  return fmt::format(
      "cam0:\n  camera_model: pinhole\n  intrinsics: [{}, {}, {}, {}]\n"
      "  distortion_model: radtan\n  distortion_coeffs: [{}, {}, {}, {}]\n"
      "  resolution: [240, 180]\n",
      fx, fy, cx, cy, k1, k2, p1, p2);
}

TEST_F(OwnRecording, TheOriginalIsReadCompletely) {
  if (!fs::exists(kSlider)) GTEST_SKIP() << "no recording in " << kSlider;
  const Result import = run("import '" + kSlider.string() + "' --out s.rawlog");
  EXPECT_EQ(import.status, 0) << import.err;
  EXPECT_THAT(import.out, testing::AllOf(testing::HasSubstr("cam0: 50000 events"),
                                         testing::HasSubstr("339 poses")));
  const Result info = run("info s.rawlog");
  EXPECT_THAT(
      info.out,
      testing::AllOf(testing::HasSubstr("cam0: 240x180 pixels"),
                     testing::HasSubstr("50000 events from 0.003811000 s to 0.174156000 s")));
  EXPECT_THAT(info.err, testing::IsEmpty()) << "a sound recording";
}

TEST_F(OwnRecording, OfOtherColumnsClockAndUnitsGivesTheSameMap) {
  if (!fs::exists(kSlider)) GTEST_SKIP() << "no recording in " << kSlider;
  write("events.csv", eventsAsCsv());
  write("poses.csv", posesAsCsv());
  write("camchain.yaml", calibrationOfKalibr());
  const Result original = run("map '" + kSlider.string() + "' --out original");
  ASSERT_EQ(original.status, 0) << original.err;
  const Result own =
      run("map events.csv --event-columns 'x y p t' --poses poses.csv --calibration camchain.yaml "
          "--strict --out own");
  ASSERT_EQ(own.status, 0) << own.err;
  EXPECT_GT(reportIn("own")["points"], 1000) << "the maps show something";
  EXPECT_TRUE(contentOf("own/map.pcd") == contentOf("original/map.pcd"));
}

}  // namespace
}  // namespace efm
