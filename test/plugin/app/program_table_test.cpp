// SPDX-License-Identifier: BSD-3-Clause
// What each command does with each kind of input: its status, the files that it makes, and what it
// says on stderr. The files that were there stay as they are.

#include <map>
#include <regex>
#include <set>

#include "test/plugin/app/app_test.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {
namespace {

using testing::HasSubstr;

namespace fs = std::filesystem;

#ifdef EFM_WITH_HDF5
constexpr bool kHasHdf5 = true;
#else
constexpr bool kHasHdf5 = false;
#endif

class ProgramTable : public AppTest {
 protected:
  /// A recording as folder, rawlog and events alone, the same in many damaged ways, and others.
  void SetUp() override {
    SyntheticRecording recording;
    write(recording);
    const std::string events = contentOf("data/cam0/events.txt");
    copyOfData("events_alone", [](const fs::path& copy) {
      for (const char* file : {"poses.txt", "camchain.yaml"}) fs::remove(copy / file);
    });
    copyOfData("no_poses", [](const fs::path& copy) { fs::remove(copy / "poses.txt"); });
    copyOfData("cut_text", [&](const fs::path& copy) {
      std::ofstream(copy / "cam0/events.txt") << "10 1 2 1\n10.02 3 4 0\n10.03 5";
    });
    copyOfData("outside", [&](const fs::path& copy) {
      std::ofstream(copy / "cam0/events.txt") << events << "10.6 120 4 0\n";
    });
    copyOfData("late_poses", [&](const fs::path& copy) {
      std::vector<StampedPose> poses = recording.poses;
      for (StampedPose& pose : poses) pose.t_ns += 100'000'000'000;
      writeTumTrajectory(copy / "poses.txt", poses);
    });
    copyOfData("lens", [&](const fs::path& copy) {
      Rig rig{recording.cameras};
      rig.cameras[1].model.distortion = DistortionModel::kRadtan;
      rig.cameras[1].model.coefficients = {0.1, 0.2, 0.3};
      std::ofstream(copy / "camchain.yaml") << formatCamchain(rig);
    });
    for (const int count : {1, 3}) {
      write(std::to_string(count) + ".yaml",
            formatCamchain(Rig{SyntheticRecording(0.1, count).cameras}));
    }
    Rig half{recording.cameras};
    for (RigCamera& camera : half.cameras) camera.model.width = 60;
    write("half.yaml", formatCamchain(half));

    write("small/events.txt", "0.010 1 2 1\n0.020 3 4 0\n0.030 5 6 1\n0.029 7 8 0\n0.050 1 1 1\n");
    write("small/groundtruth.txt",
          "0.015 0 0 0 0 0 0 1\n0.030 0.01 0 0 0 0 0 1\n0.045 0.02 0 0 0 0 0 1\n");
    write("small/calib.txt", "200 200 120 90 0 0 0 0 0\n");
    write("text", "0.010 1 2 1\n0.020 3 4 0\n");
    ASSERT_EQ(shell("gzip -k text").status, 0);
    ASSERT_EQ(run("import data --out data.rawlog").status, 0);
    const std::string rawlog = contentOf("data.rawlog");
    fs::create_hard_link(folder() / "data.rawlog", folder() / "hard.rawlog");
    fs::create_symlink("data.rawlog", folder() / "soft.rawlog");
    write("cut.rawlog", rawlog.substr(0, rawlog.size() * 7 / 10));
    write("empty.rawlog", "");
    write("picture.png", "\x89PNG\r\n\x1a\n");
    write("short", "\x97");
    std::string utf16 = "\xff\xfe";
    for (const char c : events.substr(0, 5000)) utf16 += {c, '\0'};
    write("utf16.txt", utf16);
    write("utf16le.txt", utf16.substr(2));
    std::string cr = events;
    std::replace(cr.begin(), cr.end(), '\n', '\r');
    write("cr.txt", cr);
    copyOfData("cr_folder",
               [&](const fs::path& copy) { std::ofstream(copy / "cam0/events.txt") << cr; });
    ASSERT_EQ(shell("tr '\\n' '\\r' <data/poses.txt >poses_cr.txt && iconv -f UTF-8 -t UTF-16BE "
                    "data/poses.txt >poses16.txt && mkfifo pipe")
                  .status,
              0);
    write("words.bin", std::string("\x05\0\0\0a b c", 9));

    write("wrong.ini", "[dsi]\nnum_planes = 0\n");
    write("unknown.ini", "[dsi]\nplanes = 3\n");
    write("calibration.ini", "[rig]\ncalibration = none.yaml\n");
    write("walk.txt", "0 0 0 0 0 0 0 1\n0.5 0 0 0.4 0 0 0 1\n");
    write("earlier/map.pcd", "a cloud");
    write("killed/report.partial.json", "{\"process\": 4000000, \"recording\": []}");
    write("thesis/notes.txt", "mine");
    fs::create_directory(folder() / "taken");
    cv::imwrite((folder() / "plane.tiff").string(), cv::Mat1f(90, 120, 2.0F));
    cv::imwrite((folder() / "mm.png").string(), cv::Mat_<std::uint16_t>(90, 120, std::uint16_t{9}));
    cv::imwrite((folder() / "data/own.png").string(), cv::Mat1b(2, 2, std::uint8_t{9}));
  }

  template <typename Change>
  void copyOfData(const char* name, const Change& change) const {
    fs::copy(folder() / "data", folder() / name, fs::copy_options::recursive);
    change(folder() / name);
  }
  std::map<std::string, std::string> allFiles() const {
    std::map<std::string, std::string> files;
    for (const std::string& file : filesIn(".")) {
      if (file == "stdout.txt" || file == "stderr.txt" || file == "pipe") continue;
      files[file] = contentOf(file);
    }
    return files;
  }
};

/// A command and what must come of it: see program_table.txt.
struct Row {
  std::string command;
  std::string status_and_error;
  std::set<std::string> files;
  std::string part_of_out;
};

/// `MAP` and `KEYFRAME` at the end of a name stand for the files of a map and of `depth`.
std::set<std::string> filesOf(const std::string& text) {
  const std::map<std::string, std::vector<std::string>> results = {
      {"MAP",
       {"keyframes/*/confidence.png", "keyframes/*/confidence.tiff", "keyframes/*/depth.png",
        "keyframes/*/depth.tiff", "map.html", "map.pcd", "map.png", "map.simplemap", "overview.png",
        "report.json", "trajectory.txt"}},
      {"KEYFRAME",
       {"confidence.png", "confidence.tiff", "depth.png", "depth.tiff", "points.pcd",
        "report.json"}}};
  std::set<std::string> files;
  std::istringstream names(text);
  for (std::string name; names >> name;) {
    const auto result = results.find(fs::path(name).filename());
    if (result == results.end()) {
      files.insert(name);
      continue;
    }
    for (const std::string& file : result->second)
      files.insert(fs::path(name).parent_path() / file);
  }
  return files;
}

std::vector<Row> readRows() {
  std::vector<Row> rows;
  std::ifstream table(EFM_SOURCE_DIR "/test/plugin/app/program_table.txt");
  for (std::string line; std::getline(table, line);) {
    if (line.empty() || line[0] == '#') continue;
    if (line[0] == '$') {
      rows.push_back({line.substr(std::min<std::size_t>(2, line.size())), "", {}, ""});
    } else if (line[0] == '>') {
      rows.back().part_of_out = line.substr(2);
    } else if (line[0] == '+') {
      rows.back().files = filesOf(line.substr(1));
    } else {
      rows.back().status_and_error = line;
    }
  }
  return rows;
}

TEST_F(ProgramTable, EachRowHolds) {
  const auto before = allFiles();
  const auto rows = readRows();
  ASSERT_GT(rows.size(), 100U);
  for (const Row& row : rows) {
    if (!kHasHdf5 && row.command.find("--to dsec") != std::string::npos) continue;
    SCOPED_TRACE(row.command);
    const Result result = run(row.command);

    const std::string& expected = row.status_and_error;
    std::string found = std::to_string(result.status);
    const std::string err =
        std::regex_replace(result.err, std::regex(folder().string() + "/"), "FOLDER/");
    if (!err.empty()) {
      EXPECT_EQ(err.back(), '\n');
      const std::size_t last = err.rfind('\n', err.size() - 2) + 1;
      const std::string prefix = "event-fusion: error: ";
      EXPECT_EQ(err.substr(last, prefix.size()), prefix);
      found += " " + err.substr(last + prefix.size(), err.size() - last - prefix.size() - 1);
      EXPECT_TRUE(last == 0 || err.rfind("event-fusion: warning: ", 0) == 0) << err;
    }
    const std::size_t any = expected.find("…");
    EXPECT_EQ(found.substr(0, any), expected.substr(0, any));
    EXPECT_THAT(result.out, HasSubstr(row.part_of_out));
    if (result.status == 2) {
      EXPECT_EQ(result.out, "");
    }

    std::set<std::string> made;
    for (const auto& [file, content] : allFiles()) {
      const auto earlier = before.find(file);
      if (earlier != before.end()) {
        EXPECT_TRUE(content == earlier->second) << file << " was changed";
        continue;
      }
      const std::size_t keyframe = file.find("keyframes/") + 10;
      made.insert(keyframe < 10
                      ? file
                      : file.substr(0, keyframe) + "*" + file.substr(file.find('/', keyframe)));
    }
    EXPECT_EQ(made, row.files);
    for (const auto& [file, content] : before) ASSERT_TRUE(exists(folder() / file)) << file;
    for (const std::string& file : row.files) fs::remove_all(folder() / *fs::path(file).begin());
    fs::create_directory(folder() / "taken");
  }
}

TEST_F(ProgramTable, HelpListsTheStatusesAndTheOptionFiles) {
  EXPECT_THAT(run("--help").out, HasSubstr("2    the command line or an option file is wrong"));
  EXPECT_THAT(run("map --help").out, HasSubstr("dsec, evimo2"));
}

}  // namespace
}  // namespace efm
