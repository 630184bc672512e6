// SPDX-License-Identifier: BSD-3-Clause
// `event-fusion import` and `info`: see also program_table.txt.

#include "mapping/dsi/dsi_grid.h"
#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

const std::filesystem::path kSliderDepth = EFM_SHARED_DATA "/slider_depth";

using ImportCommand = AppTest;

TEST_F(ImportCommand, ReadsTheRealSliderRecordingCompletely) {
  if (!exists(kSliderDepth)) GTEST_SKIP() << "no " << kSliderDepth;
  const Result import = run("import '" + kSliderDepth.string() + "' --out s.rawlog");
  EXPECT_EQ(import.status, 0) << import.err;
  EXPECT_THAT(import.out, AllOf(HasSubstr("cam0: 50000 events"), HasSubstr("339 poses")));
  const Result info = run("info s.rawlog");
  EXPECT_THAT(info.out, AllOf(HasSubstr("cam0: 240x180 pixels"),
                              HasSubstr("50000 events from 0.003811000 s to 0.174156000 s")));
  EXPECT_THAT(info.err, IsEmpty()) << "a sound recording";
}

TEST_F(ImportCommand, InfoTellsTheKernelsWithoutARecording) {
  const Result result = run("info --system");
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.err, IsEmpty());
  for (const VotingKernel kernel : availableKernels()) {
    EXPECT_THAT(result.out, HasSubstr("kernel " + std::string(nameOf(kernel)) +
                                      (kernel == fastestKernel() ? ": chosen" : "\n")));
  }
}

TEST_F(ImportCommand, OutputThatCannotBeWrittenIsAnError) {
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

}  // namespace
}  // namespace efm
