// SPDX-License-Identifier: BSD-3-Clause
// Runs each command of program_table.txt. Its status, its output and its new files must be as in
// the table, and files that existed before must not change.

#include <map>
#include <optional>
#include <regex>
#include <set>
#include <utility>

#include "test/plugin/app/app_test.h"

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
  /// Writes a recording of half a second ("data"; "same.pcd" is its map), a recording of 1.3 s
  /// ("long"), a recording of the UZH layout ("small"), and inputs that a shell cannot write.
  void SetUp() override {
    write(SyntheticRecording());
    writeDataset(SyntheticRecording(1.3), folder() / "long");
    mapOf("data", "same");
    fs::rename(folder() / "same" / "map.pcd", folder() / "same.pcd");
    fs::remove_all(folder() / "same");
    ASSERT_EQ(run("import data --out data.rawlog").status, 0);
    write("small/events.txt", "0.010 1 2 1\n0.020 3 4 0\n0.030 5 6 1\n0.029 7 8 0\n0.050 1 1 1\n");
    write("small/groundtruth.txt",
          "0.015 0 0 0 0 0 0 1\n0.030 0.01 0 0 0 0 0 1\n0.045 0.02 0 0 0 0 0 1\n");
    write("small/calib.txt", "200 200 120 90 0 0 0 0 0\n");
    for (const int count : {1, 3}) {
      write(std::to_string(count) + ".yaml",
            formatCamchain(Rig{SyntheticRecording(0.1, count).cameras}));
    }
    write("thesis/notes.txt", "mine");
    cv::imwrite((folder() / "plane.tiff").string(), cv::Mat1f(90, 120, 2.0F));
    cv::imwrite((folder() / "mm.png").string(), cv::Mat_<std::uint16_t>(90, 120, std::uint16_t{9}));
  }

  /// Runs a command. After "ulimit -f N; " it cannot write more than N blocks of 512 bytes.
  Result runRow(const std::string& command) const {
    const std::size_t limit = command.find("; ");
    if (limit == std::string::npos) return run(command);
    return shell(command.substr(0, limit + 2) + "'" EFM_EVENT_FUSION "' " +
                 command.substr(limit + 2));
  }
  /// Runs shell commands, which must succeed. They may read the last command's output.
  void expectSuccess(const std::string& script) const {
    const std::string functions =
        "points() { LC_ALL=C sed -nE 's/^(POINTS|element vertex) //p' $1; }\n"
        "differ() { test -s $1 -a -s $2 && ! cmp -s $1 $2; }\n";
    EXPECT_EQ(std::system(("cd '" + folder().string() + "' && { " + functions + script +
                           "\n} </dev/null >script.txt 2>&1")
                              .c_str()),
              0)
        << script << "\n"
        << contentOf("script.txt");
  }
  std::map<std::string, std::string> allFiles() const {
    const std::set<std::string> not_files = {"stdout.txt", "stderr.txt", "script.txt", "pipe"};
    std::map<std::string, std::string> files;
    for (const std::string& file : filesIn(".")) {
      if (not_files.count(file) == 0) files[file] = contentOf(file);
    }
    return files;
  }
  /// Returns the names in the folder.
  std::set<std::string> names() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder()))
      names.insert(entry.path().filename());
    return names;
  }
};

/// A command and its expected results: see program_table.txt.
struct Row {
  std::string command;
  bool is_first = true;  // if true, the earlier rows' files are removed
  std::string preparation;
  std::string status_and_errors;
  std::optional<std::set<std::string>> files;
  std::vector<std::string> warnings;
  std::vector<std::string> parts_of_out;
  std::vector<std::string> same_maps;
  std::string check;
};

/// Returns file names. `MAP`, `KEYFRAME` at a name's end: the files of a map, of `depth`.
std::set<std::string> filesOf(const std::string& text) {
  const std::map<std::string, std::vector<std::string>> results = {
      {"MAP",
       {"keyframes/*/confidence.png", "keyframes/*/confidence.tiff", "keyframes/*/depth.png",
        "keyframes/*/depth.tiff", "keyframes/*/probability.tiff", "map.html", "map.pcd", "map.png",
        "map.simplemap", "overview.png", "report.json", "session.mcap", "trajectory.txt"}},
      {"KEYFRAME",
       {"confidence.png", "confidence.tiff", "depth.png", "depth.tiff", "points.pcd",
        "probability.tiff", "report.json"}}};
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
  std::string preparation;
  std::ifstream table(EFM_SOURCE_DIR "/test/plugin/app/program_table.txt");
  for (std::string line; std::getline(table, line);) {
    const char kind = line.empty() ? '#' : line[0];
    const std::string text = line.substr(std::min<std::size_t>(2, line.size()));
    if (kind == '%') preparation += text + " &&\n";
    if (kind == '$' || kind == '&') {
      rows.push_back({text, kind == '$', std::exchange(preparation, ""), "0", {}, {}, {}, {}, ""});
    } else if (kind == '>') {
      rows.back().parts_of_out.push_back(text);
    } else if (kind == '!') {
      rows.back().warnings.push_back(text);
    } else if (kind == '+') {
      rows.back().files = filesOf(text);
    } else if (kind == '=') {
      rows.back().same_maps.push_back(text);
    } else if (kind == '?') {
      rows.back().check += text + " &&\n";
    } else if (kind != '#' && kind != '%') {
      rows.back().status_and_errors = line;
    }
  }
  return rows;
}

/// Compares two texts. Each … in the expected text stands for any text.
void expectText(const std::string& found, const std::string& expected) {
  const std::string escaped =
      std::regex_replace(expected, std::regex(R"([.^$|()\[\]{}*+?\\])"), R"(\$&)");
  const std::regex pattern(std::regex_replace(escaped, std::regex("…"), ".*"));
  EXPECT_TRUE(std::regex_match(found, pattern)) << found << "\nis not\n" << expected;
}

/// Replaces a keyframe's time in a file name by *.
std::string ofAnyKeyframe(const std::string& file) {
  return std::regex_replace(file, std::regex("keyframes/[^/]*/"), "keyframes/*/");
}

TEST_F(ProgramTable, EachRowHolds) {
  const std::set<std::string> original = names();
  std::map<std::string, std::string> inputs;
  std::map<std::string, std::string> before;
  const auto rows = readRows();
  ASSERT_GT(rows.size(), 200U);
  for (const Row& row : rows) {
    SCOPED_TRACE(row.command);
    if (row.is_first) {
      for (const std::string& name : names()) {
        if (original.count(name) == 0) fs::remove_all(folder() / name);
      }
      expectSuccess(row.preparation + "true");
      before = inputs = allFiles();
    }
    if (!kHasHdf5 && std::regex_search(row.command, std::regex("dsec|h5"))) continue;
    const Result result = runRow(row.command);

    EXPECT_TRUE(result.err.empty() || result.err.back() == '\n');
    std::string found = std::to_string(result.status);
    std::vector<std::string> warnings;
    std::istringstream err(std::regex_replace(
        result.err, std::regex(fs::canonical(folder()).string() + "/"), "FOLDER/"));
    for (std::string line; std::getline(err, line);) {
      const std::string prefixes[] = {"event-fusion: error: ", "event-fusion: warning: "};
      const std::size_t end = line.find(": ", 14) + 2;
      EXPECT_THAT(prefixes, testing::Contains(line.substr(0, end)));
      if (line.rfind(prefixes[0], 0) == 0) {
        found += " " + line.substr(end);
      } else {
        warnings.push_back(line.substr(end));
      }
    }
    expectText(found, row.status_and_errors);
    if (row.warnings != std::vector<std::string>{"…"}) {
      EXPECT_EQ(warnings.size(), row.warnings.size()) << result.err;
      for (std::size_t i = 0; i < std::min(warnings.size(), row.warnings.size()); ++i) {
        expectText(warnings[i], row.warnings[i]);
      }
    }
    for (const std::string& part : row.parts_of_out) EXPECT_THAT(result.out, HasSubstr(part));
    // The output is empty for wrong command lines, results that cannot be written, and --quiet.
    if (result.status == 2 || std::regex_search(row.command, std::regex("^ulimit|--quiet"))) {
      EXPECT_EQ(result.out, "");
    }

    const auto after = allFiles();
    std::set<std::string> made;
    for (const auto& [file, content] : after) {
      const auto input = inputs.find(file);
      if (input == inputs.end()) {
        made.insert(ofAnyKeyframe(file));
      } else {
        EXPECT_TRUE(content == input->second) << file << " was changed";
      }
    }
    for (const auto& [file, content] : inputs) ASSERT_EQ(after.count(file), 1U) << file;
    if (row.is_first || row.files) {
      EXPECT_EQ(made, row.files.value_or(std::set<std::string>()));
    } else {
      EXPECT_TRUE(after == before) << "a file was changed: " << testing::PrintToString(made);
    }
    for (const std::string& recording : row.same_maps) {
      const std::string map =
          contentOf(exists(folder() / "out" / "map.pcd") ? "out/map.pcd" : "same.pcd");
      EXPECT_TRUE(mapOf(recording, "map_of_row") == map) << recording;
      fs::remove_all(folder() / "map_of_row");
    }
    expectSuccess(row.check + "true");
    before = allFiles();
  }
}

}  // namespace
}  // namespace efm
