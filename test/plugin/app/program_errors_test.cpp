// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <mrpt/core/exceptions.h>
#include <opencv2/core.hpp>

#include <clocale>
#include <cmath>
#include <locale>
#include <new>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <system_error>

#include "plugin/app/program.h"
#include "plugin/playback/progress.h"
#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

using ::testing::StartsWith;

/// Returns the message for the user if `raise` throws.
template <typename Raise>
std::string wordsOf(const Raise& raise) {
  try {
    raise();
  } catch (const std::exception& error) {
    return userMessage(error);
  }
  return "no exception";
}

TEST(ErrorWords, HaveNothingThatALibraryAddsForItsProgrammers) {
  EXPECT_EQ(wordsOf([] { throw std::runtime_error("a.txt:3: no number"); }), "a.txt:3: no number");
  EXPECT_EQ(wordsOf([] { THROW_EXCEPTION("no such map"); }), "no such map");
  EXPECT_EQ(wordsOf([] {
              try {
                THROW_EXCEPTION("cut");
              } catch (const std::exception& error) {
                throw std::runtime_error(std::string("r.rawlog: entry 3: ") + error.what());
              }
            }),
            "r.rawlog: entry 3: cut");
  EXPECT_EQ(wordsOf([] { throw std::runtime_error("full\n\nCall stack backtrace:\n[0 ] 0x7f"); }),
            "full");
  EXPECT_THAT(wordsOf([] { CV_Error(cv::Error::StsBadArg, "wrong size"); }), "wrong size");
  EXPECT_EQ(wordsOf([] { return std::filesystem::file_size("none.txt"); }),
            "none.txt: No such file or directory");
  EXPECT_EQ(wordsOf([] {
              throw std::filesystem::filesystem_error(
                  "copy", "a", "b", std::error_code(ENOSPC, std::generic_category()));
            }),
            "a to b: the disk is full");
  for (const std::string& text :
       {wordsOf([] { throw std::bad_alloc(); }), wordsOf([] { throw std::bad_array_new_length(); }),
        wordsOf([] { std::vector<char>().reserve(SIZE_MAX); }),
        wordsOf([] { CV_Error(cv::Error::StsNoMem, "Failed to allocate 8 bytes"); }),
        wordsOf([] { throw std::runtime_error("x.bag: std::bad_alloc"); })}) {
    EXPECT_THAT(text, StartsWith("out of memory: try fewer planes"));
  }
}

}  // namespace

using ProgramOutput = AppTest;

TEST_F(ProgramOutput, ThatCannotBeWrittenIsAnError) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  writeDataset(SyntheticRecording(0.1), folder() / "data");
  for (const char* arguments : {"info data", "import data --out s.rawlog", "--help", "--version"}) {
    const Result result =
        shell("{ '" EFM_EVENT_FUSION "' " + std::string(arguments) + " >/dev/full; }");
    EXPECT_NE(result.status, 0) << arguments;
    EXPECT_THAT(result.err,
                testing::StartsWith("event-fusion: error: the output cannot be written"))
        << arguments;
  }
}

// Results after a signal. test/integration/interruption_test.cpp stops `map` at any time.

namespace {

using testing::HasSubstr;

class Interrupted : public AppTest {
 protected:
  /// Returns whether a file name contains `part`. Files may appear and vanish during the search.
  bool anyNameHas(const std::string& part) const {
    std::error_code gone;
    std::filesystem::recursive_directory_iterator entry(folder(), gone);
    for (; !gone && entry != end(entry); entry.increment(gone)) {
      if (entry->path().filename().string().find(part) != std::string::npos) return true;
    }
    return false;
  }
};

TEST_F(Interrupted, CommandsLeaveTheirWholeResultOrNothing) {
  write(SyntheticRecording(5.0));
  struct Command {
    const char* arguments;
    const char* started;  // a part of the unfinished result's name
    const char* result;
    bool is_long;  // the command cannot end before the signal
  };
  const Command cases[] = {
      {"import data --out r.rawlog", "r.partial", "r.rawlog", false},
      {"export data --to mcap --out m.mcap", "m.partial", "m.mcap", false},
      {"export data --to folder --out copy", "copy.unfinished", "copy/poses.txt", false},
      {"simulate --preset desk_stereo --out desk", "desk.unfinished", "desk/poses.txt", true},
      {"depth rig.ini data --out depth --save-dsi --t0 10.1 --t1 14", "depth.partial",
       "depth/report.json", false}};
  for (const auto& [arguments, started, expected, is_long] : cases) {
    const Result result = interrupted(arguments, [&, part = started] { return anyNameHas(part); });
    EXPECT_FALSE(anyNameHas("partial") || anyNameHas("unfinished")) << arguments;
    ASSERT_TRUE(result.status == 130 || (result.status == 0 && !is_long)) << arguments;
    EXPECT_EQ(exists(folder() / expected), result.status == 0) << arguments;
    if (result.status == 130) {
      EXPECT_THAT(result.err, HasSubstr("event-fusion: stopped by a signal: there is no result"));
      EXPECT_EQ(result.out, "");
    }
  }
}

TEST_F(Interrupted, AStoppedMapReplacesAnEarlierResultAndAKilledOneDoesNot) {
  write(SyntheticRecording(4.0));  // 400 keyframes: the run cannot end before the signal
  const std::string map = "map rig.ini data --out out";
  const std::string slow = map + " --set keyframes.stride_s=0.01";
  const auto writes = [this] { return exists(folder() / "out.partial" / "keyframes"); };
  ASSERT_EQ(run(map).status, 0);
  const std::size_t whole = reportIn("out")["keyframes"];
  const Result stopped = interrupted(slow, writes);
  EXPECT_EQ(stopped.status, 130);
  const nlohmann::json report = reportIn("out");
  EXPECT_LE(report["stopped_at"], 1) << "a small file is read at once";
  const std::string percent = std::to_string(std::lround(100 * report["stopped_at"].get<double>()));
  EXPECT_THAT(stopped.out, HasSubstr("of recording, stopped at " + percent + " %"));
  EXPECT_THAT(stopped.err,
              HasSubstr("event-fusion: stopped at " + percent + " % of the recording"));
  const std::size_t keyframes = report["keyframes"];
  EXPECT_GT(keyframes, 0U);
  EXPECT_EQ(posesIn("out").size(), keyframes);
  const auto files = filesIn("out");
  EXPECT_EQ(files.size(), 8 + 5 * keyframes);

  const std::string earlier = contentOf("out/map.pcd");
  EXPECT_EQ(interrupted(slow, writes, SIGKILL).status, -1);
  EXPECT_EQ(filesIn("out"), files);
  EXPECT_EQ(contentOf("out/map.pcd"), earlier);
  EXPECT_EQ(reportIn("out"), report);
  ASSERT_EQ(run(map).status, 0);
  EXPECT_EQ(filesIn("out").size(), 8 + 5 * whole) << "nothing of the killed run";
}

TEST_F(Interrupted, TwoImportsOfOneNameWriteTheWholeResultOfOne) {
  importRecording(SyntheticRecording());
  ASSERT_EQ(run("import data --out cut.rawlog --t1 10.4").status, 0);
  const std::string import = "'" EFM_EVENT_FUSION "' import data --out r.rawlog";
  ASSERT_EQ(shell("{ " + import + " & " + import + " --t1 10.4 && wait $!; }").status, 0);
  EXPECT_THAT(contentOf("r.rawlog"),
              testing::AnyOf(contentOf("data.rawlog"), contentOf("cut.rawlog")));
  EXPECT_FALSE(anyNameHas("partial"));
}

}  // namespace

// A host program may write numbers as 1.234,5. Files and results must not do so.

namespace {

/// Writes numbers as 1.234,5.
class Grouping : public std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

/// Sets the locale of C++ and, if it is installed, the locale of C.
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
    for (const char* key :
         {"seconds", "cpu_seconds", "votes_per_second", "peak_memory_bytes", "session"}) {
      report.erase(key);
    }
    return report;
  }
};

TEST_F(NumbersOfFiles, DoNotFollowTheLocaleOfTheProgram) {
  write("rig.ini", "[dsi]\nmin_depth_m = 0.55\n[keyframes]\nwindow_s = 0.125\nstride_s = 0.05\n");
  const std::string commands[] = {
      "simulate --preset desk_stereo --duration 2e-1 --out data",
      "import data --out r.rawlog",
      "export r.rawlog --to folder --out copy",
      "export r.rawlog --to mcap --out m.mcap",
      "info copy --poses copy/poses.txt --calibration copy/camchain.yaml",
      "map rig.ini copy --out map --set output.ply=true --set refinement.enabled=true",
      "depth rig.ini copy --out depth --t0 +0 --t1 +0.2 --save-dsi",
      "evaluate map map/map.pcd data/gt_edges.ply --json",
      "evaluate map map/map.ply data/gt_edges.ply --json",
      "evaluate depth depth/depth.tiff data/depth/cam0_1.100000000.tiff --json",
      "evaluate trajectory map/trajectory.txt data/poses.txt --align none --json"};
  const auto runAll = [&](const std::string& name) {
    std::vector<std::string> printed;
    for (const std::string& command : commands) {
      const Result result = run(command);
      EXPECT_EQ(result.status, 0) << command << ": " << result.err;
      const bool is_timed = command.rfind("map", 0) == 0 || command.rfind("depth", 0) == 0;
      printed.push_back(is_timed ? "" : result.out);
    }
    for (const char* out : {"data", "r.rawlog", "copy", "m.mcap", "map", "depth"}) {
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
    if (name == "map.html" || name == "session.mcap") continue;  // with the times of the report
    const std::string expected = contentOf("classic/" + file);
    const std::string content = contentOf("grouping/" + file);
    if (name == "report.json") {
      EXPECT_EQ(withoutTimes(content), withoutTimes(expected)) << file;
    } else {
      EXPECT_TRUE(content == expected) << file << ": " << content.substr(0, 300);
    }
  }
}

/// A stream, a clock and a terminal. The test sets the clock and the terminal's width.
struct FakeTerminal {
  std::ostringstream stream;
  double now_s = 1000;
  std::optional<int> columns;

  ProgressOutput output() {
    return {stream, [this] { return columns; }, [this] { return now_s; }};
  }
  /// Returns the text that was written since the last call.
  std::string written() {
    std::string text = stream.str();
    stream.str("");
    return text;
  }
};

TEST(Progress, OnATerminalFillsItsWidthAndFallsBackToTheWordsAlone) {
  const std::pair<int, std::string> cases[] = {
      // 59 of 60 columns: the last column stays free
      {60, "mapping [=====                  ]  25 %, 30 s left, details"},
      {200, "mapping [==========                              ]  25 %, 30 s left, details"},
      {35, "mapping  25 %, 30 s left, details"},
      {20, "mapping  25 %, 30 s"}};
  for (const auto& [columns, line] : cases) {
    FakeTerminal terminal;
    terminal.columns = columns;
    Progress progress("mapping", Verbosity::kNormal, terminal.output());
    progress.show(0.25, "details");
    EXPECT_EQ(terminal.written(), "") << "due after 0.2 s";
    terminal.now_s += 10;
    EXPECT_TRUE(progress.due());
    progress.show(0.25, "details");
    EXPECT_EQ(terminal.written(), "\r\033[K" + line);
    progress.show(0.3);
    EXPECT_EQ(terminal.written(), "") << "the next line is not due";
  }
}

TEST(Progress, TheLineIsRemovedAtTheEndAndBeforeALineThatStays) {
  FakeTerminal terminal;
  terminal.columns = 80;
  {
    Progress progress("importing", Verbosity::kVerbose, terminal.output());
    progress.begin("writing");
    EXPECT_EQ(terminal.written(), "\r\033[Kwriting");
    progress.print("keyframe 1");
    EXPECT_EQ(terminal.written(), "\r\033[Kkeyframe 1\n");
    progress.begin("writing");
    terminal.written();
  }
  EXPECT_EQ(terminal.written(), "\r\033[K");
}

TEST(Progress, ElsewhereIsAPlainLineNowAndThen) {
  FakeTerminal terminal;
  Progress progress("exporting", Verbosity::kNormal, terminal.output());
  std::vector<int> times_s;
  for (int second = 1; second <= 300; ++second) {
    terminal.now_s = 1000 + second;
    progress.show(second / 400.0);
    if (!terminal.written().empty()) times_s.push_back(second);
  }
  EXPECT_THAT(times_s, testing::ElementsAre(10, 30, 70, 130, 190, 250));
  terminal.now_s = 1310;
  progress.show(0.5, "7 keyframes");
  EXPECT_EQ(terminal.written(), "event-fusion: exporting  50 %, 5:10 min left, 7 keyframes\n");
  progress.print("keyframe 1");
  EXPECT_EQ(terminal.written(), "") << "not verbose";
}

TEST(Progress, IsSilentIfQuiet) {
  for (const std::optional<int> columns : {std::optional<int>(), std::optional<int>(80)}) {
    FakeTerminal terminal;
    terminal.columns = columns;
    {
      Progress progress("mapping", Verbosity::kQuiet, terminal.output());
      terminal.now_s += 1000;
      EXPECT_FALSE(progress.due());
      progress.show(0.5);
      progress.begin("writing");
      progress.print("keyframe 1");
    }
    EXPECT_EQ(terminal.written(), "");
  }
}

}  // namespace

}  // namespace efm
