// SPDX-License-Identifier: BSD-3-Clause
// MRPT's rawlog-grabber with our sensor, which plays a recording.

#include <gmock/gmock.h>

#include "test/paths.h"
#include "test/plugin/program_test.h"

namespace efm {
namespace {

class RawlogGrabber : public ProgramTest {};

/// rawlog-grabber writes the older half of what it has, again and again, and never the last one.
TEST_F(RawlogGrabber, GrabsARecordingWithoutLosingAnything) {
  if (!isInstalled("rawlog-grabber")) GTEST_SKIP() << "rawlog-grabber is not installed";
  write(SyntheticRecording());
  write("key.sh",
        "for i in $(seq 400); do\n"
        "  sleep 0.2\n"
        "  all=$(sed -n 's/.* the end of data: \\([0-9]*\\) obs.*/\\1/p' log)\n"
        "  saved=$(awk '/Saved/ {n += $(NF - 1)} END {print n}' log)\n"
        "  [ -n \"$all\" ] && [ \"$saved\" = \"$all\" ] && break\n"
        "done\n"
        "echo\n");

  write("play.ini",
        "[global]\nrawlog_prefix = grabbed\ntime_between_launches = 0\nGRABBER_PERIOD_MS = 20\n"
        "[player]\ndriver = CEventPlayer\nprocess_rate = 200\nrecording = data\nspeed = 20\n");
  // It ends when a key is pressed.
  const Result result =
      shell("touch log && sh key.sh | timeout 100 stdbuf -oL rawlog-grabber -p '" EFM_SENSOR
            "' play.ini > log 2>&1; cat log");

  ASSERT_EQ(result.status, 0);
  EXPECT_THAT(result.out, testing::HasSubstr("the end of data: "));
  ASSERT_EQ(shell("mv grabbed_*.rawlog grabbed.rawlog").status, 0) << result.out;
  EXPECT_EQ(mapOf("grabbed.rawlog", "out"), mapOf("data", "expected"));
}

}  // namespace
}  // namespace efm
