// SPDX-License-Identifier: BSD-3-Clause
#include <mrpt/core/exceptions.h>

#include <chrono>
#include <new>
#include <opencv2/core.hpp>
#include <optional>
#include <random>
#include <stdexcept>
#include <system_error>

#include "plugin/app/program.h"
#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

/// What an exception of `raise` says to the user.
template <typename Raise>
std::string wordsOf(const Raise& raise) {
  try {
    raise();
  } catch (const std::exception& error) {
    return inWords(error);
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

TEST(Hdf5Trial, SaysHowAProgramFails) {
  using std::chrono::milliseconds;
  constexpr milliseconds kLong(60'000);
  EXPECT_EQ(failureOf({"true"}, kLong), std::nullopt);
  EXPECT_EQ(failureOf({"sh", "-c", "kill -s SEGV $$"}, kLong), "crashes");
  EXPECT_EQ(failureOf({"sh", "-c", "exit 3"}, kLong), "crashes");
  EXPECT_EQ(failureOf({"sleep", "600"}, milliseconds(50)), "does not end within 0.05 s");
  EXPECT_EQ(failureOf({"/no/such/program"}, kLong), std::nullopt) << "then it is read all the same";
}

class Hdf5Trials : public AppTest {};

TEST_F(Hdf5Trials, LeaveTheErrorToTheProgram) {
  write(SyntheticRecording());
  ASSERT_EQ(shell("'" EFM_EVENT_FUSION "' export data --to dsec --out good").status, 0);
  const std::filesystem::path file = "good/events/left/events.h5";
  write("damaged.h5", contentOf(file).substr(0, 2'000));
  for (const char* source : {"good", "damaged.h5", "missing.h5"}) {
    const Result trial = shell(std::string("'" EFM_EVENT_FUSION "' --try-hdf5 ") + source);
    EXPECT_EQ(trial.status, 0);
    EXPECT_EQ(trial.out + trial.err, "");
  }
  EXPECT_EQ(shell("'" EFM_EVENT_FUSION "' info good").status, 0);
  EXPECT_THAT(shell("'" EFM_EVENT_FUSION "' info damaged.h5").err,
              HasSubstr("damaged.h5: cannot be opened as HDF5"));
}

/// Files above 50 blocks (of 512 or 1024 bytes, by the shell) cannot be written, as if the disk
/// were full.
class LimitedFiles : public AppTest {
 protected:
  Result runLimited(const std::string& arguments) const {
    return shell("ulimit -f 50; '" EFM_EVENT_FUSION "' " + arguments);
  }
  void SetUp() override {
    AppTest::SetUp();
    write(SyntheticRecording());
    shell("true");  // makes stdout.txt and stderr.txt
    // Random pixels do not compress.
    std::string events;
    std::mt19937 random(1);
    for (int i = 0; i < 60'000; ++i) {
      events += "0." + std::to_string(100'000 + i) + " " + std::to_string(random() % 120) + " " +
                std::to_string(random() % 90) + " " + std::to_string(i % 2) + "\n";
    }
    write("many/events.txt", events);
  }
};

TEST_F(LimitedFiles, EachWriterSaysWhyAndLeavesNothingIncomplete) {
  const char* const why = "the file would be larger than the system allows (ulimit -f)\n";
  const std::string camera = " --calibration data/camchain.yaml --poses data/poses.txt";
  for (const char* job : {"import many/events.txt many/events.txt --out r.rawlog",
                          "export many/events.txt many/events.txt --to mcap --out m.mcap",
#ifdef EFM_WITH_HDF5
                          "export many/events.txt many/events.txt --to dsec --out h5",
#endif
                          "export many/events.txt many/events.txt --to folder --out text"}) {
    const auto before = filesIn(".");
    const Result result = runLimited(job + camera);
    EXPECT_EQ(result.status, 1) << job;
    EXPECT_THAT(result.err, AllOf(StartsWith("event-fusion: error: "), HasSubstr("larger than"),
                                  Not(HasSubstr("Call stack")), Not(HasSubstr("errno"))))
        << job;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(filesIn("."), before) << job;
  }
  const Result map =
      runLimited("map rig.ini data --out out --set dsi.width=300 --set dsi.height=300");
  EXPECT_EQ(map.status, 1);
  EXPECT_EQ(map.err.substr(map.err.find("tiff: ") + 6), why) << map.err;
}

}  // namespace
}  // namespace efm
