// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <string>
#include <vector>

#include "plugin/recordings/open/recording_formats.h"
#include "plugin/recordings/streams/pose_conflict.h"
#include "test/plugin/recordings/columns/zip_file.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

class PoseFile : public TemporaryFolder {
 protected:
  /// Expects two poses: at t0 and t1, at (1, 2, 3) and (4, 5, 6), rotated by (0.5, 0.5, 0.5, 0.5)
  /// and (0.8, 0, 0, 0.6), x y z w.
  static void expectTwo(const std::vector<StampedPose>& poses, std::int64_t t0_ns,
                        std::int64_t t1_ns, const std::string& what) {
    ASSERT_EQ(poses.size(), 2U) << what;
    const StampedPose expected[] = {{t0_ns, {{0.5, 0.5, 0.5, 0.5}, {1, 2, 3}}},
                                    {t1_ns, {{0.6, 0.8, 0, 0}, {4, 5, 6}}}};
    for (const std::size_t i : {0, 1}) {
      const Rigid3& T_world_rig = poses[i].T_world_rig;
      const Rigid3& T_expected = expected[i].T_world_rig;
      EXPECT_EQ(poses[i].t_ns, expected[i].t_ns) << what;
      EXPECT_EQ(T_world_rig.translation, T_expected.translation) << what;
      EXPECT_LT((T_world_rig.rotation.conjugate() * T_expected.rotation).vec().norm(), 1e-12)
          << what;
    }
  }
  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    writeFile(folder() / name, bytes);
    return folder() / name;
  }
  std::string errorOfFile(const std::string& name, const std::string& bytes) const {
    write(name, bytes);
    return errorOf([&] { readPoses(folder() / name); });
  }
};

constexpr const char* kTum =
    "# the rig\n1.000000001 1 2 3 0.5 0.5 0.5 0.5\n\n1700000000.123456789 4 5 6 0.8 0 0 0.6\n";

TEST_F(PoseFile, TextHasTheColumnsOfTheTumBenchmarkOrOfItsHeader) {
  const struct {
    const char* name;
    std::string text;
    std::int64_t t0_ns;
    std::int64_t t1_ns;
  } rows[] = {
      {"poses.txt", kTum, 1'000'000'001, 1'700'000'000'123'456'789},
      {"mocap_data.txt",
       "# timestamp px py pz qx qy qz qw\n928218 1 2 3 0.5 0.5 0.5 0.5\n936552 4 5 6 0.8 0 0 0.6\n",
       928'218'000, 936'552'000},
      {"header.txt",
       "timestamp[us] tx ty tz qx qy qz qw\n1700000000123456 1 2 3 0.5 0.5 0.5 0.5\n"
       "1700000000123457.5 4 5 6 0.8 0 0 0.6\n",
       1'700'000'000'123'456'000, 1'700'000'000'123'457'500},
      {"blank_unit.txt",
       "# time [ms] x y z qx qy qz qw\n7 1 2 3 .5 .5 .5 .5\n8.5 4 5 6 0.8 0 0 0.6\n", 7'000'000,
       8'500'000},
      {"mark.txt", std::string("\xEF\xBB\xBF") + kTum, 1'000'000'001, 1'700'000'000'123'456'789},
      {"mark.csv", "\xEF\xBB\xBFt_ns,x,y,z,qx,qy,qz,qw\n5,1,2,3,.5,.5,.5,.5\n7,4,5,6,.8,0,0,.6\n",
       5, 7},
      {"data.csv",
       "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], "
       "q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1]\r\n"
       "1403636580838555648,1,2,3,0.5,0.5,0.5,0.5,9\r\n1403636580838555649,4,5,6,0.6,0.8,0,0,9\r\n",
       1'403'636'580'838'555'648, 1'403'636'580'838'555'649},
      {"other.csv",
       "\"qw\";\"qx\";\"qy\";\"qz\";\"pos_x\";\"pos_y\";\"pos_z\";\"t_ns\"\n0.5;0.5;0.5;0.5;1;2;3;"
       "5\n"
       "0.6;0.8;0;0;4;5;6;7\n",
       5, 7},
      {"millimetres.csv",
       "t_ns,qw,qx,qy,qz,x_mm,y_cm,z [m]\n5,0.5,0.5,0.5,0.5,1000,200,3\n"
       "7,0.6,0.8,0,0,4000,500,6\n",
       5, 7},
      {"blank_millimetres.txt",
       "# t [s] tx [mm] ty [mm] tz [mm] qx qy qz qw\n1.5 1000 2000 3000 0.5 0.5 0.5 0.5\n"
       "2.5 4000 5000 6000 0.8 0 0 0.6\n",
       1'500'000'000, 2'500'000'000},
  };
  for (const auto& row : rows) {
    expectTwo(readPoses(write(row.name, row.text)), row.t0_ns, row.t1_ns, row.name);
  }
}

TEST_F(PoseFile, TheUnitOfWholeNumbersIsToldOrCertain) {
  std::string lines;
  for (int i = 0; i < 12; ++i) lines += std::to_string(928'218 + i) + " 1 2 3 0 0 0 1\n";
  EXPECT_THAT(errorOfFile("small.txt", lines),
              AllOf(HasSubstr("small.txt: all times are whole"), HasSubstr("--pose-time-unit ms")));
  ReaderOptions options;
  options.time_unit = "us";
  EXPECT_EQ(readPoses(folder() / "small.txt", options)[1].t_ns, 928'219'000);
  options.pose_time_unit = "ms";  // of the poses alone
  EXPECT_EQ(readPoses(folder() / "small.txt", options)[1].t_ns, 928'219'000'000);
  options.pose_time_unit.clear();
  std::filesystem::create_directory(folder() /
                                    "mocap_data");  // TUM-VIE's file is known by its own name
  EXPECT_THAT(errorOfFile("mocap_data/poses.txt", "t tx ty tz qx qy qz qw\n" + lines),
              HasSubstr("all times are whole"));
  // Nanoseconds with decimals, and numbers of more columns than a pose has.
  lines.clear();
  for (int i = 0; i < 12; ++i) lines += std::to_string(1'200 + i) + "000000.0 1 2 3 0 0 0 1\n";
  EXPECT_THAT(errorOfFile("decimals.txt", lines), HasSubstr("--pose-time-unit ns"));
  ReaderOptions nanoseconds;
  nanoseconds.pose_time_unit = "ns";
  EXPECT_EQ(readPoses(folder() / "decimals.txt", nanoseconds)[1].t_ns, 1'201'000'000);
  EXPECT_THAT(errorOfFile("numbered.txt", "0 7 1 2 3 0 0 0 1\n"),
              HasSubstr("numbered.txt:1: 9 fields: expected 8, t tx ty tz qx qy qz qw; name them"));
  // The unit is found from the first 100 poses; all poses are read.
  for (const int count : {99, 100}) {
    lines.clear();
    for (int i = 0; i < count; ++i) lines += std::to_string(928'218 + i) + " 1 2 3 0 0 0 1\n";
    for (int i = 0; i < 40'000; ++i) lines += "930000.5 1 2 3 0.5 -0.5 0.5 -0.5\n";
    const std::string error = errorOfFile("long.txt", lines);
    EXPECT_THAT(error, HasSubstr(count == 99 ? "no error" : "all times are whole"));
  }
  EXPECT_EQ(readPoses(folder() / "long.txt", options).size(), 40'100U);
  // Decimals are seconds: the option is for the events. Compressed text is read as text.
  writeGzip(folder() / "poses.txt.gz", kTum);
  writeZip(folder() / "poses.zip", {{"a/poses.txt", kTum}});
  for (const auto& file :
       {write("poses.txt", kTum), folder() / "poses.txt.gz", folder() / "poses.zip"}) {
    expectTwo(readPoses(file, options), 1'000'000'001, 1'700'000'000'123'456'789, file.string());
  }
}

TEST_F(PoseFile, AFolderAndARecordingHaveTheirOwnPoses) {
  write("events.txt", "0.1 1 2 0\n");
  write("groundtruth.txt", kTum);
  expectTwo(readPoses(folder()), 1'000'000'001, 1'700'000'000'123'456'789, "folder");
  write("groundtruth.txt",
        "#timestamp [us],qw,qx,qy,qz,px,py,pz\n1000000.001,.5,.5,.5,.5,1,2,3\n"
        "1700000000123456.789,.6,.8,0,0,4,5,6\n");
  expectTwo(readPoses(folder()), 1'000'000'001, 1'700'000'000'123'456'789, "with a header");
}

TEST_F(PoseFile, AnErrorNamesTheFileThePlaceAndTheExpectedValue) {
  const std::string header = "#t [us], tx, ty, tz, qx, qy, qz, qw\n";
  const struct {
    const char* name;
    std::string bytes;
    const char* error;
  } cases[] = {
      {"a.txt", "", "a.txt: an empty file"},
      {"a.txt", "1 2 3\n", "a.txt:1: 3 fields: expected 8, t tx ty"},
      {"a.txt", "1.5 1 2 3 0 0 0 1\nabc 1 2 3 0 0 0 1\n",
       "a.txt:2: t = 'abc': expected a decimal time"},
      {"a.txt", "1.5,1,2,3,0,0,0,1\n", "a.txt:1: commas without a header"},
      {"a.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 9 0 1 0 0 0 0 1 0\n",
       "a.txt:1: 12 numbers, as poses of KITTI have, which have no times: expected t tx ty tz"},
      {"a.csv", "#t [us], tx, ty, tz, qx, qy, qz\n", "there is no column qw"},
      {"a.csv", "t_us,x [ft],y [ft],z [ft],qx,qy,qz,qw\n",
       "a.csv:1: the unit 'ft' of tx: expected"},
      {"a.txt", "1.5 1 2 3 10 20 30\n", "7 fields: expected 8, t tx ty tz qx qy qz qw (angles are"},
      {"a.csv", header + "1,1,2,3,0,0,0\n", "a.csv:2: 7 fields: expected 8, as in the header"},
      {"a.csv", header + "1,1,2,3,0,0,0,z\n", "a.csv:2: qw = 'z': expected a finite number"},
      {"a.bin", std::string("\x7f\0ELF", 5), "a.bin: not a file of poses: expected text"},
      {"a.npy", npyArray<double>("<f8", "(1, 8)", std::vector<double>(8)),
       "(1, 8): expected poses as text. Python writes them: import numpy as np, event_fusion as "
       "ef"},
      {"a.gz", "\x1f\x8b garbage", "a.gz: cannot be unpacked"},
      {"a.zip", "PK\x03\x04 garbage", "a.zip: cannot be unpacked"},
  };
  for (const auto& row : cases) {
    EXPECT_THAT(errorOfFile(row.name, row.bytes), HasSubstr(row.error)) << row.name;
  }
  writeZip(folder() / "d.zip", {{"a.txt", kTum}, {"b.txt", kTum}});
  EXPECT_THAT(errorOf([&] { readPoses(folder() / "d.zip"); }), HasSubstr("several files in it"));
  EXPECT_THAT(errorOf([&] { readPoses(folder() / "nowhere"); }),
              HasSubstr("nowhere: cannot be opened for reading"));
}

/// A body that moves by 1 m/s, 100 times a second from 5 s on.
std::string poseLine(double t_s, double y, const char* separator = " ", const char* more = "") {
  return fmt::format("{:.6f}{}{:.4f}{}{:.3f}{}0.5{}0{}0{}0{}1{}\n", t_s, separator, t_s, separator,
                     y, separator, separator, separator, separator, separator, more);
}

TEST_F(PoseFile, OneFileHasOneTrajectoryAndAnErrorTellsHowToTakeIt) {
  const auto lines = [](int count, double first_s, double y) {
    std::string text;
    for (int i = 0; i < count; ++i) text += poseLine(first_s + 0.01 * i, y);
    return text;
  };
  std::string alternating, sparse, equal, csv = "name,t,x,y,z,qx,qy,qz,qw\n", few, turned, lost;
  for (int i = 0; i < 300; ++i) {
    const double t_s = 5 + 0.01 * i;
    alternating += poseLine(t_s, 0) + poseLine(t_s + 30e-6, 1);
    sparse += poseLine(t_s, 0) + (i % 10 == 5 ? poseLine(t_s + 0.004, -0.6) : "");
    equal += poseLine(t_s, 0) + poseLine(t_s, 0.002);
    csv += "1," + poseLine(t_s, 0, ",") + "2," + poseLine(t_s + 0.005, 2, ",");
    lost += i % 12 == 0 ? fmt::format("{:.6f} 0 0 0 0 0 0 1\n", t_s) : poseLine(t_s, 0);
    few += poseLine(t_s, 0) + (i % 150 == 5 ? poseLine(t_s, 1) : "");
    turned += poseLine(t_s, 0) + fmt::format("{:.6f} {:.4f} 0 0.5 0 0.6 0 0.8\n", t_s + 0.004, t_s);
  }
  const struct {
    const char* name;
    std::string text;
    const char* error;   // null: none
    const char* places;  // in the error
  } rows[] = {
      {"alternating", alternating, "poses of two bodies: 598 of 600 poses", "line 3"},
      {"sparse", sparse, "poses of two bodies", "line 8"},
      {"equal times", equal, "300 of 300 times have poses that differ", "line 1 and line 2"},
      {"with a header", csv, "poses of two bodies", "line 4"},
      {"turned", turned, "0.01 m and 73.7 degrees apart", "line 3"},
      {"one after the other", lines(300, 5, 0) + lines(300, 5.5, 1),
       "the times go back at line 301", "line 51 and line 301"},
      {"a clock that was set back by 0.2 s", lines(3000, 5, 0) + lines(3000, 34.8, 0.2),
       "the times go back at line 3001", "0.2"},
      {"few equal times", few, nullptr, ""},
      {"lost now and then", lost, nullptr, ""},
      {"two parts in another order", lines(300, 8, 0) + lines(300, 5, 0), nullptr, ""},
      {"one body twice", lines(300, 5, 0) + lines(300, 5, 0.0005), nullptr, ""},
  };
  const std::size_t count = readPoses(write("first.txt", lines(300, 5, 0))).size();
  for (const auto& row : rows) {
    const std::string name = row.name == std::string("with a header") ? "a.csv" : "a.txt";
    const std::string error = errorOfFile(name, row.text);
    if (row.error == nullptr) {
      EXPECT_EQ(error, "no error") << row.name;
      continue;
    }
    EXPECT_THAT(error, AllOf(HasSubstr(name + ": "), HasSubstr(row.error), HasSubstr(row.places)))
        << row.name;
    // The command in the error is followed to the letter.
    const std::string marker = "the poses of the first one: ";
    ASSERT_THAT(error, HasSubstr(marker)) << row.name;
    std::string command = error.substr(error.find(marker) + marker.size());
    command.pop_back();  // the bracket
    command.replace(command.find("FILE"), 4, (folder() / name).string());
    command.replace(command.find("NEW"), 3, (folder() / "new.csv").string());
    ASSERT_EQ(std::system(command.c_str()), 0) << command;
    const auto poses = readPoses(folder() / "new.csv");
    EXPECT_GE(poses.size(), count) << row.name << ": " << command;
    for (const StampedPose& pose : poses) {
      EXPECT_LE(std::abs(pose.T_world_rig.translation.y()), 1e-9) << row.name << ": " << command;
    }
  }
}

// Of a body that moves, exactly a burst with wrong times is left out; poses that come late are not.
RC_GTEST_PROP(PoseConflict, FindsABurstOfWrongTimesAlone, ()) {
  const auto length = *rc::gen::inRange<std::size_t>(1, 900);
  // More right poses than wrong ones lie on each side, also without the one that comes late.
  const auto at = *rc::gen::inRange<std::size_t>(length + 2, 3998 - 2 * length);
  const auto shift_ms = *rc::gen::oneOf(rc::gen::inRange<std::int64_t>(1000, 400'000'000),
                                        rc::gen::inRange<std::int64_t>(-400'000'000, -1000));
  // Within a second before or after the motion, nothing tells that the times are wrong.
  const auto first_ms = static_cast<std::int64_t>(at) + shift_ms;
  const auto last_ms = first_ms + static_cast<std::int64_t>(length) - 1;
  RC_PRE(!(first_ms >= -1000 && last_ms < 0) && !(first_ms > 3999 && last_ms <= 4999));
  const auto comes_late = *rc::gen::element<std::size_t>(0, 1, 20);  // poses later
  const auto late = *rc::gen::inRange<std::size_t>(0, 3900);
  std::vector<StampedPose> poses;
  for (std::int64_t ms = 0; ms < 4000; ++ms) {
    const double s = 1e-3 * static_cast<double>(ms);
    poses.push_back({ms * 1'000'000, {Eigen::Quaterniond::Identity(), {s, std::sin(3 * s), 0}}});
  }
  std::vector<std::size_t> expected(length);
  std::iota(expected.begin(), expected.end(), at);
  for (const std::size_t i : expected) poses[i].t_ns += shift_ms * 1'000'000;
  if (late + comes_late < at || late > at + length) {
    const auto from = poses.begin() + static_cast<std::ptrdiff_t>(late);
    std::rotate(from, from + 1, from + 1 + static_cast<std::ptrdiff_t>(comes_late));
  }
  RC_ASSERT(findWrongTimes(poses) == expected);
}

TEST_F(PoseFile, TimesOfPosesAreNeitherNumbersOfFramesNorOneTime) {
  const auto file = [](const std::vector<std::string>& times) {
    std::string text = "# t tx ty tz qx qy qz qw\n";
    for (std::size_t i = 0; i < times.size(); ++i) {
      text += fmt::format("{} {} 0 0 0 0 0 1\n", times[i], 0.01 * static_cast<double>(i));
    }
    return text;
  };
  std::vector<std::string> frames, decimals, keyframes, dates, six, milliseconds;
  for (int i = 0; i < 200; ++i) {
    frames.push_back(std::to_string(i));
    decimals.push_back(fmt::format("{}.0", i));
    if (i % 7 < 2) keyframes.push_back(fmt::format("{}.000000", i));
    dates.push_back(fmt::format("{:g}", 1.7e9 + 0.01 * i));
    six.push_back(fmt::format("{:g}", 12345.6 + 0.01 * i));
    milliseconds.push_back(std::to_string(17'000 + 5 * i));
  }
  EXPECT_THAT(errorOfFile("a.txt", file(dates)),
              HasSubstr("the first 100 poses have one time, 1.7"));
  EXPECT_THAT(errorOfFile("a.txt", file(six)), HasSubstr("the times have six digits: write"));
  EXPECT_THAT(errorOfFile("a.txt", file(milliseconds)), HasSubstr("--pose-time-unit ms"));
  std::string times;
  for (int i = 0; i < 200; ++i) times += fmt::format("{:.3f}\n", 100 + 0.02 * i);
  write("times.txt", times);
  for (const auto& numbers : {frames, decimals, keyframes}) {
    const std::string error = errorOfFile("a.txt", file(numbers));
    EXPECT_THAT(error, HasSubstr("numbers of frames?"));
    std::string command = error.substr(error.find("awk"));
    command.resize(command.find("NEW)"));
    command.replace(command.find("TIMES"), 5, (folder() / "times.txt").string());
    command.replace(command.find("FILE"), 4, (folder() / "a.txt").string());
    ASSERT_EQ(std::system((command + (folder() / "new.txt").string()).c_str()), 0) << command;
    const auto poses = readPoses(folder() / "new.txt");
    ASSERT_EQ(poses.size(), numbers.size());
    for (std::size_t i = 0; i < poses.size(); ++i) {
      EXPECT_EQ(poses[i].t_ns, 100'000'000'000 + 20'000'000 * std::stoll(numbers[i]));
    }
    ReaderOptions options;
    options.pose_time_unit = "s";
    EXPECT_EQ(readPoses(folder() / "a.txt", options).size(), numbers.size()) << "they are seconds";
  }
}

using namespace std::string_literals;

class UnreadFormats : public TemporaryFolder {
 protected:
  std::string nameOf(const std::string& bytes) const {
    writeFile(folder() / "file", bytes);
    EXPECT_EQ(detectFormat(folder() / "file"), nullptr) << bytes;
    return unreadFormat(folder() / "file").value_or("");
  }
};

TEST_F(UnreadFormats, AreNamedByTheirFirstBytes) {
  const std::pair<std::string, const char*> cases[] = {
      {"version https://git-lfs.github.com/spec/v1\noid sha256:1\n", "a pointer of git-LFS"},
      {"#!AER-DAT1.0\r\n", "an AEDAT 1 file: "},
      {"#!AER-DAT2.0\r\n# raw AE data\r\n", "an AEDAT 2 file: "},
      {"#!AER-DAT3.1\r\n", "an AEDAT 3 file: "},
      {"\xd4\xc3\xb2\xa1\x02\0\x04\0"s, "a network capture (PCAP)"},
      {"\x0a\x0d\x0d\x0a\x1c\0\0\0"s, "a network capture (PCAPNG)"},
      {"\x89PNG\r\n\x1a\n", "a PNG picture"},
      {"\xff\xd8\xff\xe0", "a JPEG picture"},
      {"II*\0\x08"s, "a TIFF picture"},
      {"RIFF\x10\0\0\0AVI LIST"s, "an AVI video"},
      {"\0\0\0\x18"s + "ftypmp42", "an MP4 video"},
      {"\x1a\x45\xdf\xa3", "a Matroska video"},
      {"7z\xbc\xaf\x27\x1c\0\4"s, "a 7z archive: unpack it"},
      {"Rar!\x1a\x07\x01\0"s, "a RAR archive: unpack it"},
      {"a.bag" + std::string(252, '\0') + "ustar", "a tar archive: unpack it"},
      {"PAR1\x15", "a Parquet file"},
      {"MATLAB 5.0 MAT-file, Platform: GLNXA64", "a MATLAB file"},
      {"MATLAB 7.3 MAT-file, Platform: GLNXA64", "a MATLAB file"},
      {"\x80\x04\x95\x10", "a pickle of Python objects"},
      {"\x7f\x45LF\x02", "a program (ELF)"},
      {"%PDF-1.5\n", "a PDF document"},
      {"ply\nformat ascii 1.0\n", "a point cloud"},
      {"\n <!DOCTYPE HTML>\n<html>", "an HTML page: the download failed"},
      {"<html lang=\"en\">", "an HTML page"},
      {"<?xml version=\"1.0\"?><Error/>", "an XML document"},
      {"", "an empty file"},
      {std::string(512, '\0'), "a file of zeros"},
  };
  for (const auto& [bytes, name] : cases) EXPECT_THAT(nameOf(bytes), StartsWith(name));
}

TEST_F(UnreadFormats, OwnResultsSayWhatShowsThem) {
  const std::string what =
      ": expected a recording; `event-fusion view` shows a map, `event-fusion ev";
  const std::string report = R"({"version": "1", "votes_per_second": 1})";
  EXPECT_THAT(nameOf(report), StartsWith("the report of an earlier run" + what));
  EXPECT_EQ(nameOf(R"({"version": "1"})"), "");
  EXPECT_THAT(nameOf("<!DOCTYPE html>\n<meta name=\"generator\" content=\"event-fusion\">"),
              StartsWith("the page of a map" + what));
  EXPECT_THAT(nameOf("# .PCD v0.7 - Point Cloud Data\n"), StartsWith("a point cloud (PCD)" + what));
  std::filesystem::remove(folder() / "file");
  writeFile(folder() / "map.html", "<!DOCTYPE html>");
  writeFile(folder() / "report.json", "{}");
  EXPECT_THAT(unreadFormat(folder()).value_or(""),
              StartsWith("a folder; map.html in it is an HTML"));
  writeFile(folder() / "report.json", report);
  EXPECT_THAT(unreadFormat(folder()).value_or(""),
              StartsWith("the result of an earlier run" + what));
}

TEST_F(UnreadFormats, AreNamedWithinCompressedFiles) {
  const std::filesystem::path file = folder() / "file";
  const auto name_of_zip = [&](const std::vector<std::pair<std::string, std::string>>& members) {
    writeZip(file, members);
    return unreadFormat(file).value_or("");
  };
  EXPECT_THAT(name_of_zip({{"a.txt", "1 2"}, {"b.txt", "1 2"}}),
              StartsWith("a zip archive: unpack it"));
  EXPECT_THAT(name_of_zip({{"a.bag", "#ROSBAG V2.0\n"}}),
              StartsWith("a compressed ROS 1 bag: unpack"));
  EXPECT_THAT(name_of_zip({{"a.png", "\x89PNG\r\n"}}), StartsWith("a PNG picture"));
  writeGzip(file, "\x89HDF\r\n\x1a\n");
  EXPECT_THAT(unreadFormat(file).value_or(""), StartsWith("a compressed HDF5 file: unpack it"));
  writeGzip(file, "a.bag" + std::string(252, '\0') + "ustar");
  EXPECT_THAT(unreadFormat(file).value_or(""), StartsWith("a tar archive: unpack it"));
}

TEST_F(UnreadFormats, OthersHaveNoName) {
  // A rawlog's first object, an unknown file, and text that contains a magic word.
  for (const std::string& bytes :
       {"\x93"s + "CObservationRobotPose", "\x01\x02\x03"s, "see <html>"s, " ftypmp42"s}) {
    EXPECT_EQ(nameOf(bytes), "");
  }
  EXPECT_FALSE(unreadFormat(folder() / "none"));
}

TEST_F(UnreadFormats, AFolderIsNamedByTheFilesInIt) {
  const auto folder_of = [&](const std::string& name, const std::string& bytes) {
    std::filesystem::remove_all(folder() / "in");
    std::filesystem::create_directory(folder() / "in");
    if (!name.empty()) writeFile(folder() / "in" / name, bytes);
    return unreadFormat(folder() / "in").value_or("");
  };
  EXPECT_EQ(folder_of("", ""), "an empty folder: expected a recording");
  EXPECT_THAT(folder_of("1.png", "\x89PNG\r\n\x1a\n"),
              StartsWith("a folder; 1.png in it is a PNG pi"));
  EXPECT_THAT(folder_of("0.mcap", "\x89MCAP0\r\n"),
              StartsWith("a folder: give its files themselves (0.mcap is a ROS 2 bag"));
  EXPECT_EQ(folder_of("readme", "words"), "");
  for (const char* name : {"m.png", "b.png", "a", "aa", "ab", "ac", "h.png"}) {  // the first file
    writeFile(folder() / "in" / name, name[0] == 'a' ? "words" : "\x89PNG\r\n\x1a\n");
  }
  EXPECT_THAT(unreadFormat(folder() / "in").value_or(""),
              StartsWith("a folder; b.png in it is a PNG"));
}

}  // namespace

}  // namespace efm
