// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/app/progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

namespace efm {
namespace {

/// A stream, a clock and a terminal that the test sets.
struct FakeTerminal {
  std::ostringstream stream;
  double now_s = 1000;
  std::optional<int> columns;

  ProgressOutput output() {
    return {stream, [this] { return columns; }, [this] { return now_s; }};
  }
  /// What was written since the last call.
  std::string written() {
    std::string text = stream.str();
    stream.str("");
    return text;
  }
};

TEST(Progress, OnATerminalFillsItsWidthAndFallsBackToTheWordsAlone) {
  const std::pair<int, std::string> cases[] = {
      // 59 of 60 columns: the last one stays free.
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
