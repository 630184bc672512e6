// SPDX-License-Identifier: BSD-3-Clause
// MRPT's rawlog-edit on our rawlogs, with the plugin.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "test/paths.h"
#include "test/plugin/program_test.h"

namespace efm {
namespace {

using testing::AllOf;
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

TEST_F(RawlogEdit, ExportedTextHasTheEventsOfEachCamera) {
  ASSERT_EQ(edit("--export-txt").status, 0);
  for (const std::size_t camera : {0, 1}) {
    std::istringstream text(contentOf("data_cam" + std::to_string(camera) + ".txt"));
    std::string line;
    std::getline(text, line);
    EXPECT_THAT(line, HasSubstr("NUM_EVENTS"));
    std::size_t events = 0;
    double time = 0;
    for (std::size_t count = 0; text >> time >> count && std::getline(text, line);) events += count;
    EXPECT_EQ(events, recording_.events[camera].size());
  }
}

TEST_F(RawlogEdit, APartOfARawlogIsReadAgain) {
  const std::string events = std::to_string(recording_.events[0].size()) + " events";
  ASSERT_EQ(edit("--cut --from-time 10.1 --to-time 10.3 -o cut.rawlog").status, 0);
  EXPECT_THAT(run("info cut.rawlog").out,
              AllOf(HasSubstr("21 poses from 10.100000000 s to 10.300000000 s"),
                    HasSubstr("cam0: 120x90"), HasSubstr("cam1: 120x90")));
  ASSERT_EQ(edit("--keep-label cam0,pose -o kept.rawlog").status, 0);
  EXPECT_THAT(run("info kept.rawlog").out,
              AllOf(HasSubstr(events), HasSubstr("51 poses"), Not(HasSubstr("cam1"))));
}

}  // namespace
}  // namespace efm
