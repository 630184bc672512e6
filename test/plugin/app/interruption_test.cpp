// SPDX-License-Identifier: BSD-3-Clause
// What a signal leaves of the commands other than `map`: see
// test/integration/interruption_test.cpp.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

using testing::AnyOf;
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

TEST_F(Interrupted, AnInputNamedLikeATemporaryFileStays) {
  importRecording(SyntheticRecording());
  const std::string rawlog = contentOf("data.rawlog");
  write("r.partial.rawlog", rawlog);
  write("other.partial.rawlog", "of another program");
  ASSERT_EQ(run("import r.partial.rawlog --out r.rawlog").status, 0);
  EXPECT_EQ(contentOf("r.partial.rawlog"), rawlog);
  EXPECT_EQ(contentOf("r.rawlog"), rawlog);
  ASSERT_EQ(run("import data --out other.rawlog").status, 0);
  EXPECT_EQ(contentOf("other.partial.rawlog"), "of another program");
  ASSERT_EQ(run("export r.rawlog --to mcap --out m.partial.mcap").status, 0);
  const std::string mcap = contentOf("m.partial.mcap");
  ASSERT_EQ(
      run("export m.partial.mcap --calibration data/camchain.yaml --to mcap --out m.mcap").status,
      0);
  EXPECT_EQ(contentOf("m.partial.mcap"), mcap);
  EXPECT_EQ(contentOf("m.mcap"), mcap);
  EXPECT_FALSE(anyNameHas("partial-"));
}

TEST_F(Interrupted, AStoppedRunReplacesAnEarlierResultAndAKilledOneDoesNot) {
  write(SyntheticRecording(4.0));
  const std::string map = "map rig.ini data --out out";
  const std::string slow = map + " --set keyframes.stride_s=0.01";
  const auto writes = [this] { return anyNameHas("depth.partial-"); };
  ASSERT_EQ(run(map).status, 0);
  const std::size_t whole = reportIn("out")["keyframes"];
  ASSERT_EQ(interrupted(slow, writes).status, 130);
  const nlohmann::json report = reportIn("out");
  EXPECT_TRUE(report.contains("stopped_at"));
  const auto files = filesIn("out");
  EXPECT_EQ(files.size(), 7 + 4 * report["keyframes"].get<std::size_t>());

  const std::string earlier = contentOf("out/map.pcd");
  EXPECT_EQ(interrupted(slow, writes, SIGKILL).status, -1);
  EXPECT_THAT(filesIn("out"), testing::IsSupersetOf(files));
  EXPECT_EQ(contentOf("out/map.pcd"), earlier);
  EXPECT_EQ(reportIn("out"), report);
  ASSERT_EQ(run(map).status, 0);
  EXPECT_EQ(filesIn("out").size(), 7 + 4 * whole) << "nothing of the killed run";
}

TEST_F(Interrupted, AResultThatIsReplacedIsNamed) {
  importRecording(SyntheticRecording());
  const std::string place = std::filesystem::canonical(folder()).string();
  const auto warningOf = [&](const std::string& recording) {
    const Result result = run("map rig.ini " + recording + " --out out");
    EXPECT_EQ(result.status, 0);
    const nlohmann::json report = reportIn("out");
    EXPECT_EQ(report["recording"][0], place + "/" + recording);
    EXPECT_EQ(report["warnings"].size(), result.err.empty() ? 0U : 1U);
    return result.err;
  };
  const std::string warning = "event-fusion: warning: replaced-result: out holds ";
  EXPECT_EQ(warningOf("data"), "");
  EXPECT_EQ(warningOf("data"), "") << "the same recording";
  EXPECT_EQ(warningOf("data.rawlog"),
            warning + "the result of " + place + "/data (4 keyframes): this run replaces it\n");
  std::filesystem::remove(folder() / "out/report.json");
  std::filesystem::remove_all(
      std::filesystem::directory_iterator(folder() / "out/keyframes")->path());
  write("out/report.partial.json", R"({"recording": ["/a.bag", "/b.txt"], "process": 1})");
  EXPECT_EQ(warningOf("data.rawlog"),
            warning +
                "3 keyframes of /a.bag, /b.txt, left by a run that did not end: this run "
                "replaces them\n");
}

TEST_F(Interrupted, TwoImportsOfOneNameWriteTheWholeResultOfOne) {
  importRecording(SyntheticRecording());
  ASSERT_EQ(run("import data --out cut.rawlog --t1 10.4").status, 0);
  const std::string import = "'" EFM_EVENT_FUSION "' import data --out r.rawlog";
  ASSERT_EQ(shell("{ " + import + " & " + import + " --t1 10.4 && wait $!; }").status, 0);
  EXPECT_THAT(contentOf("r.rawlog"), AnyOf(contentOf("data.rawlog"), contentOf("cut.rawlog")));
  EXPECT_FALSE(anyNameHas("partial"));
}

}  // namespace
}  // namespace efm
