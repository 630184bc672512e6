// SPDX-License-Identifier: BSD-3-Clause
// What a signal leaves of the commands other than `map`: see
// test/integration/interruption_test.cpp.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

using testing::HasSubstr;

class Interrupted : public AppTest {
 protected:
  /// Files may come and go meanwhile.
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
    const char* started;  // a part of the name of the unfinished result
    const char* result;
    bool is_long;  // it cannot end before the signal
  };
  const Command cases[] = {
      {"import data --out r.rawlog", "r.partial", "r.rawlog", false},
      {"export data --to mcap --out m.mcap", "m.partial", "m.mcap", false},
      {"export data --to folder --out copy", "copy.unfinished", "copy/poses.txt", false},
      {"simulate --preset desk_stereo --out desk", "desk.unfinished", "desk/poses.txt", true},
      {"depth rig.ini data --out depth --save-dsi --t0 10.1 --t1 14", "dsi.partial",
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

TEST_F(Interrupted, AnImportReplacesWhatAKilledOneLeft) {
  write(SyntheticRecording());
  write("r.partial.rawlog", std::string(1'000'000, 'x'));
  ASSERT_EQ(run("import data --out r.rawlog").status, 0);
  ASSERT_EQ(run("import data --out clean.rawlog").status, 0);
  EXPECT_EQ(contentOf("r.rawlog"), contentOf("clean.rawlog"));
  EXPECT_FALSE(anyNameHas("partial"));
}

}  // namespace
}  // namespace efm
