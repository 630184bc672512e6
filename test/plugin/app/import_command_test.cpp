// SPDX-License-Identifier: BSD-3-Clause
// `event-fusion simulate`, `import` and `info`.

#include <gmock/gmock.h>

#include <cstdlib>

#include "mapping/dsi/dsi_grid.h"
#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

const std::filesystem::path kSliderDepth = EFM_SHARED_DATA "/slider_depth";

class ImportCommand : public AppTest {
 protected:
  /// A recording in the UZH layout.
  void writeSmallRecording() const {
    write("small/events.txt", "0.010 1 2 1\n0.020 3 4 0\n0.030 5 6 1\n0.029 7 8 0\n0.050 1 1 1\n");
    write("small/groundtruth.txt",
          "0.015 0 0 0 0 0 0 1\n0.030 0.01 0 0 0 0 0 1\n0.045 0.02 0 0 0 0 0 1\n");
    write("small/calib.txt", "200 200 120 90 0 0 0 0 0\n");
  }
};

TEST_F(ImportCommand, WritesARawlogAndPrintsItsContents) {
  writeSmallRecording();
  const Result result = run("import small --out s.rawlog");
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.err, IsEmpty());
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("cam0: 5 events"), HasSubstr("3 poses"),
                    HasSubstr("1 events were out of order"), HasSubstr("bytes per event")));
  EXPECT_TRUE(exists(folder() / "s.rawlog"));
}

TEST_F(ImportCommand, AnyCompressionAndPacketLengthGivesTheSameMap) {
  write(SyntheticRecording());
  const std::string map = mapOf("data");
  for (const std::string options : {"--compression gzip", "--compression zstd",
                                    "--compression none", "--compression zstd --packet-s 0.001"}) {
    ASSERT_EQ(run("import data --out r.rawlog " + options).status, 0) << options;
    EXPECT_EQ(mapOf("r.rawlog"), map) << options;
  }
  EXPECT_THAT(errorOf("import data --out r.rawlog --packet-s 0"), HasSubstr("--packet-s"));
}

TEST_F(ImportCommand, ACutRawlogStillAnnouncesItsCameras) {
  write(SyntheticRecording());
  ASSERT_EQ(run("import data --out cut.rawlog --t0 10.1 --t1 10.4").status, 0);
  ASSERT_EQ(run("import cut.rawlog --out again.rawlog --compression zstd").status, 0);
  EXPECT_EQ(mapOf("cut.rawlog"), mapOf("data --t0 10.1 --t1 10.4"));
  EXPECT_EQ(mapOf("again.rawlog"), mapOf("cut.rawlog"));
}

TEST_F(ImportCommand, EventsAloneAreImportedAndExported) {
  write(SyntheticRecording());
  const std::string rest = " --calibration data/camchain.yaml --poses data/poses.txt";
  const std::string map = mapOf("data");
  for (const std::string command : {"import --out e.rawlog", "export --to folder --out text",
#ifdef EFM_WITH_HDF5
                                    "export --to dsec --out h5",
#endif
                                    "export --to mcap --out e.mcap"}) {
    const Result result = run(command + " data/cam0/events.txt data/cam1/events.txt");
    ASSERT_EQ(result.status, 0) << command << result.err;
    EXPECT_THAT(result.err,
                AllOf(HasSubstr("warning: no-calibration: camera 0 has no calibration: a map"),
                      HasSubstr("no-calibration: camera 1"),
                      HasSubstr("warning: no-poses: there are no poses: a map needs")))
        << command;
    const std::string out = command.substr(command.rfind(' ') + 1);
    EXPECT_EQ(mapOf(out + rest), map) << command;
    EXPECT_THAT(errorOf("map rig.ini " + out + " --out no --poses data/poses.txt"),
                HasSubstr("no calibration: "))
        << command;
    EXPECT_THAT(errorOf("map rig.ini " + out + " --out no --calibration data/camchain.yaml"),
                HasSubstr("--poses"))
        << command;
  }
  EXPECT_THAT(run("info e.rawlog").out, HasSubstr("cam1: unknown size, no calibration"));
  const Result again = run("export e.rawlog --to folder --out again" + rest);
  EXPECT_EQ(again.err, "");
  EXPECT_EQ(mapOf("again"), map);
}

TEST_F(ImportCommand, OfADamagedRecordingAllBeforeTheDamageIsWritten) {
  write(SyntheticRecording());
  const std::string events = contentOf("data/cam0/events.txt");
  const std::size_t line = events.find('\n', events.size() / 2) + 1;
  write("data/cam0/events.txt", events.substr(0, line) + "damage\n" + events.substr(line));
  const auto lines = std::to_string(
      std::count(events.begin(), events.begin() + static_cast<std::ptrdiff_t>(line), '\n'));
  for (const std::string command :
       {"import data --out d.rawlog", "export data --to folder --out text",
        "export data --to mcap --out d.mcap"}) {
    const std::string out = command.substr(command.rfind(' ') + 1);
    const Result result = run(command);
    EXPECT_EQ(result.status, 1) << command;
    EXPECT_THAT(result.err,
                AllOf(HasSubstr("data/cam0/events.txt:"), HasSubstr("'damage': expected"),
                      HasSubstr("poses before it are written to " + out + "\n")));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    const Result info =
        run("info " + out + (out == "d.mcap" ? " --calibration data/camchain.yaml" : ""));
    EXPECT_THAT(info.out, HasSubstr("\n  " + lines + " events from ")) << command << info.err;
  }
  const std::string rawlog = contentOf("d.rawlog");
  write("cut.rawlog", rawlog.substr(0, rawlog.size() / 2));
  const Result cut = run("import cut.rawlog --out c.rawlog");
  EXPECT_EQ(cut.status, 1);
  EXPECT_THAT(cut.err, HasSubstr("stopped at entry"));
  EXPECT_EQ(run("import c.rawlog --out again.rawlog").status, 0) << "it is whole";
}

TEST_F(ImportCommand, TheTruthOfAFolderIsExportedWithIt) {
  write(SyntheticRecording());
  write("data/depth/index.txt", "# t file\n10.100000000 a.tiff\n10.300000000 b.tiff\n");
  write("data/depth/a.tiff", "first");
  write("data/depth/b.tiff", "second");
  EXPECT_THAT(run("info data").out, HasSubstr("truth: 2 depth maps of camera 0"));
  ASSERT_EQ(run("export data --to folder --out text --t0 10.3").status, 0);
  EXPECT_EQ(contentOf("text/depth/index.txt"), "10.300000000 cam0_10.300000000.tiff\n");
  EXPECT_EQ(contentOf("text/depth/cam0_10.300000000.tiff"), "second");
  write("data/depth/index.txt", "10.1 a.tiff\nlater b.tiff\n");
  EXPECT_THAT(errorOf("info data"), HasSubstr("depth/index.txt:2: 'later b.tiff': expected"));
}

TEST_F(ImportCommand, AnExportedFolderGivesTheSameMap) {
  write(SyntheticRecording());
  ASSERT_EQ(run("import data --out r.rawlog").status, 0);
  const Result result = run("export r.rawlog --to folder --out text");
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_EQ(contentOf("text/cam1/events.txt"), contentOf("data/cam1/events.txt"));
  EXPECT_EQ(contentOf("text/poses.txt").rfind('#'), 0U) << "a header, and no other one";
  EXPECT_EQ(mapOf("text"), mapOf("data"));
  EXPECT_FALSE(exists(folder() / "text" / "depth"));
  EXPECT_THAT(errorOf("export r.rawlog --to folder --out text"),
              HasSubstr("exists already and is not an empty folder"));
}

TEST_F(ImportCommand, InfoIsTheSameForAFolderAndItsRawlog) {
  writeSmallRecording();
  ASSERT_EQ(run("import small --out s.rawlog").status, 0);
  const Result folder = run("info small");
  const Result rawlog = run("info s.rawlog");
  EXPECT_EQ(folder.status, 0);
  EXPECT_THAT(folder.out,
              AllOf(HasSubstr("cam0: 240x180 pixels, focal length 200 px, distortion radtan"),
                    HasSubstr("5 events from 0.010000000 s to 0.050000000 s"),
                    HasSubstr("3 poses from 0.015000000 s to 0.045000000 s"),
                    HasSubstr("field of view 61.9 x 48.5 degrees"), HasSubstr("  rate |"),
                    HasSubstr("largest gap 0.015 s, after 0.015000000 s (+0.005 s)\n"),
                    HasSubstr("  path "), HasSubstr("the poses cover 75.0 % of the events' time"),
                    HasSubstr("1 events before the first pose, 1 after the last"),
                    HasSubstr("1 events out of order")));
  EXPECT_EQ(rawlog.status, 0);
  // That events were sorted is known only of the text.
  const std::size_t sorted = folder.out.find("1 events out of order");
  const std::size_t end = folder.out.find('\n', sorted) + 1;
  EXPECT_EQ(rawlog.out, folder.out.substr(0, sorted) + folder.out.substr(end));
  EXPECT_THAT(rawlog.out, HasSubstr("the options that are auto would be:\n  window_s = 0.2: "));
}

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

TEST_F(ImportCommand, InfoTellsTheProcessorAndItsKernelsWithoutARecording) {
  const Result result = run("info --system");
  EXPECT_EQ(result.status, 0);
  EXPECT_THAT(result.err, IsEmpty());
  EXPECT_THAT(result.out,
              AllOf(HasSubstr("processor: "), HasSubstr("cores: "), HasSubstr("kernel plain\n")));
  for (const VotingKernel kernel : availableKernels()) {
    EXPECT_THAT(result.out, HasSubstr("kernel " + std::string(nameOf(kernel)) +
                                      (kernel == fastestKernel() ? ": chosen" : "\n")));
  }
  writeSmallRecording();
  EXPECT_THAT(run("info small --system").out,
              AllOf(HasSubstr("processor: "), HasSubstr("cam0: 240x180")));
  const Result nothing = run("info");
  EXPECT_NE(nothing.status, 0);
  EXPECT_THAT(nothing.err, HasSubstr("SOURCE is required"));
}

// --- Bad input ---------------------------------------------------------------------------------

TEST_F(ImportCommand, OutputThatCannotBeWrittenIsAnError) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  writeSmallRecording();
  for (const char* arguments :
       {"info small", "import small --out s.rawlog", "--help", "--version"}) {
    const std::string command = "cd '" + folder().string() + "' && '" EFM_EVENT_FUSION "' " +
                                arguments + " >/dev/full 2>stderr.txt";
    EXPECT_NE(std::system(command.c_str()), 0) << arguments;
    EXPECT_THAT(contentOf("stderr.txt"),
                StartsWith("event-fusion: error: the output cannot be written"))
        << arguments;
  }
}

}  // namespace
}  // namespace efm
