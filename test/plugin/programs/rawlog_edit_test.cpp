// SPDX-License-Identifier: BSD-3-Clause
// MRPT's rawlog-edit on our rawlogs, with the plugin.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "test/paths.h"
#include "test/plugin/program_test.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

class RawlogEdit : public ProgramTest {
 protected:
  void SetUp() override {
    if (!isInstalled("rawlog-edit")) GTEST_SKIP() << "rawlog-edit is not installed";
    importRecording(recording_);
  }

  Result edit(const std::string& arguments) const {
    return shell("rawlog-edit -p '" EFM_PLUGIN "' -i data.rawlog " + arguments);
  }

  SyntheticRecording recording_;
};

TEST_F(RawlogEdit, InfoCountsOurObservations) {
  const Result result = edit("--info");
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.out, AllOf(HasSubstr("All sensor labels                 : cam0, cam1, pose"),
                                HasSubstr("Observations format               : Yes"),
                                Not(HasSubstr("not registered"))));
}

TEST_F(RawlogEdit, DescribePrintsTheContentsOfAPacket) {
  const Result result = edit("--describe");
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.out, AllOf(HasSubstr("ClassName: efm::CObservationEvents"),
                                ContainsRegex("Events of camera 1: [1-9]"),
                                HasSubstr("Sensor: 120x90 pixels, fx 100 fy 100")));
}

TEST_F(RawlogEdit, ExportedTextHasEveryEventOfACamera) {
  const Result result = edit("--export-txt");
  ASSERT_EQ(result.status, 0) << result.err;

  for (int camera = 0; camera < 2; ++camera) {
    const std::vector<Event>& events = recording_.events[static_cast<std::size_t>(camera)];
    std::istringstream text(contentOf("data_cam" + std::to_string(camera) + ".txt"));
    std::string line;
    std::getline(text, line);
    EXPECT_THAT(line, HasSubstr("NUM_EVENTS"));
    std::size_t read = 0;
    while (std::getline(text, line)) {
      std::istringstream row(line);
      double packet_time = 0;
      std::size_t count = 0;
      ASSERT_TRUE(row >> packet_time >> count) << line;
      for (std::size_t i = 0; i < count; ++i, ++read) {
        std::string time;
        int x = 0;
        int y = 0;
        int polarity = 0;
        ASSERT_TRUE(row >> time >> x >> y >> polarity) << line;
        ASSERT_LT(read, events.size());
        const Event& event = events[read];
        EXPECT_EQ(time, formatSeconds(event.t_ns));
        EXPECT_EQ(std::make_tuple(x, y, polarity == 1),
                  std::make_tuple(event.x, event.y, event.polarity));
      }
    }
    EXPECT_EQ(read, events.size());
  }
}

TEST_F(RawlogEdit, ACutRawlogIsReadAgain) {
  ASSERT_EQ(edit("--cut --from-time 10.1 --to-time 10.3 -o cut.rawlog").status, 0);
  const Result result = run("info cut.rawlog");
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("21 poses from 10.100000000 s to 10.300000000 s"),
                                HasSubstr("cam0: 120x90"), HasSubstr("cam1: 120x90")));
}

TEST_F(RawlogEdit, KeepLabelKeepsOneCameraAndThePoses) {
  ASSERT_EQ(edit("--keep-label cam0,pose -o kept.rawlog").status, 0);
  const Result result = run("info kept.rawlog");
  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr(std::to_string(recording_.events[0].size()) + " events"),
                                HasSubstr("51 poses"), Not(HasSubstr("cam1"))));
}

TEST_F(RawlogEdit, WithoutThePluginTheClassIsUnknown) {
  const Result result = shell("rawlog-edit -i data.rawlog --info");
  EXPECT_THAT(result.out + result.err, HasSubstr("efm::CObservationEvents"));
}

}  // namespace
}  // namespace efm
