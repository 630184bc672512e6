// SPDX-License-Identifier: BSD-3-Clause
// A host program may write numbers as 1.234,5: files and results do not follow it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <clocale>
#include <locale>

#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

/// 1.234,5
class Grouping : public std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

/// The locales of C++ and, if it is installed, of C.
class GroupingLocale {
 public:
  GroupingLocale()
      : before_(std::locale::global(std::locale(std::locale::classic(), new Grouping))) {
    std::setlocale(LC_NUMERIC, "de_DE.UTF-8");
  }
  ~GroupingLocale() {
    std::locale::global(before_);
    std::setlocale(LC_NUMERIC, "C");
  }
  GroupingLocale(const GroupingLocale&) = delete;
  GroupingLocale& operator=(const GroupingLocale&) = delete;

 private:
  std::locale before_;
};

class NumbersOfFiles : public AppTest {
 protected:
  static nlohmann::json withoutTimes(const std::string& text) {
    auto report = nlohmann::json::parse(text);
    for (const char* key : {"seconds", "cpu_seconds", "votes_per_second", "peak_memory_bytes"}) {
      report.erase(key);
    }
    return report;
  }
};

TEST_F(NumbersOfFiles, DoNotFollowTheLocaleOfTheProgram) {
  write("rig.ini", "[dsi]\nmin_depth_m = 0.55\n[keyframes]\nwindow_s = 0.125\nstride_s = 0.05\n");
  const std::string commands[] = {
      "simulate --preset desk_stereo --duration 25e-2 --out data",
      "import data --out r.rawlog",
      "export r.rawlog --to folder --out copy",
      "export r.rawlog --to mcap --out m.mcap",
      "info copy --poses copy/poses.txt --calibration copy/camchain.yaml",
      "map rig.ini copy --out map --set output.ply=true --set refinement.enabled=true",
      "depth rig.ini copy --out depth --t0 +0 --t1 +0.2 --save-dsi",
      "evaluate map map/map.pcd data/gt_edges.ply --json",
      "evaluate map map/map.ply data/gt_edges.ply --json",
      "evaluate depth depth/depth.tiff data/depth/cam0_1.100000000.tiff --json --plot d.png",
      "evaluate trajectory map/trajectory.txt data/poses.txt --align none --json --plot t.png"};
  const auto runAll = [&](const std::string& name) {
    std::vector<std::string> printed;
    for (const std::string& command : commands) {
      const Result result = run(command);
      EXPECT_EQ(result.status, 0) << command << ": " << result.err;
      const bool is_timed = command.rfind("map", 0) == 0 || command.rfind("depth", 0) == 0;
      printed.push_back(is_timed ? "" : result.out);
    }
    for (const char* out :
         {"data", "r.rawlog", "copy", "m.mcap", "map", "depth", "d.png", "t.png"}) {
      std::filesystem::create_directory(folder() / name);
      std::error_code missing;
      std::filesystem::rename(folder() / out, folder() / name / out, missing);
    }
    return printed;
  };
  const std::vector<std::string> printed = runAll("classic");
  {
    const GroupingLocale grouping;
    EXPECT_EQ(runAll("grouping"), printed);
  }
  const std::vector<std::string> files = filesIn("classic");
  EXPECT_EQ(filesIn("grouping"), files);
  EXPECT_GT(files.size(), 40U);
  for (const std::string& file : files) {
    if (!exists(folder() / "grouping" / file)) continue;
    const std::string name = std::filesystem::path(file).filename().string();
    if (name == "map.html") continue;  // it has the times of the report
    const std::string expected = contentOf("classic/" + file);
    const std::string content = contentOf("grouping/" + file);
    if (name == "report.json") {
      EXPECT_EQ(withoutTimes(content), withoutTimes(expected)) << file;
    } else {
      EXPECT_TRUE(content == expected) << file << ": " << content.substr(0, 300);
    }
  }
}

}  // namespace
}  // namespace efm
