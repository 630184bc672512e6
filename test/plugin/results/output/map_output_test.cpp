// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <opencv2/imgcodecs.hpp>

#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <future>
#include <stdexcept>
#include <thread>
#include <vector>

#include "mapping/base/atomic_file.h"
#include "mapping/base/npy_header.h"
#include "plugin/results/output/keyframe_writer.h"
#include "plugin/results/output/map_output.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// Returns a keyframe of 4 x 3 pixels. One pixel has a depth.
KeyframeDepthMap smallKeyframe(std::int64_t t_ref_ns) {
  KeyframeDepthMap keyframe;
  keyframe.window = {t_ref_ns - 10, t_ref_ns + 10, t_ref_ns};
  keyframe.view = {4, 3, 2.0, 2.0, 1.0, 1.0};
  keyframe.T_world_ref.translation = {1, 2, 3};
  keyframe.map.depth = cv::Mat1f::zeros(3, 4);
  keyframe.map.confidence = cv::Mat1f::zeros(3, 4);
  keyframe.map.depth(1, 2) = 1.2345678F;
  keyframe.map.confidence(1, 2) = 17.5F;
  return keyframe;
}

class MapOutputTest : public TemporaryFolder {};

TEST_F(MapOutputTest, AKeyframeIsWrittenBelowItsTime) {
  const KeyframeDepthMap small = smallKeyframe(1'700'000'000'123'456'789);
  MapOutput(folder() / "out", OutputKind::kMap, {}).writeKeyframe(small);

  const auto keyframe = folder() / "out" / "keyframes" / "1700000000.123456789";
  const cv::Mat depth = cv::imread((keyframe / "depth.tiff").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(depth.type(), CV_32F);
  EXPECT_EQ(depth.at<float>(1, 2), 1.2345678F);
  EXPECT_EQ(depth.at<float>(0, 0), 0.0F);
  const cv::Mat confidence =
      cv::imread((keyframe / "confidence.tiff").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(confidence.type(), CV_32F);
  EXPECT_EQ(confidence.at<float>(1, 2), 17.5F);
  const cv::Mat probability =
      cv::imread((keyframe / "probability.tiff").string(), cv::IMREAD_UNCHANGED);
  EXPECT_TRUE(std::isnan(probability.at<float>(1, 2))) << "not known";
  EXPECT_EQ(probability.at<float>(0, 0), 0.0F);
  const auto sizeOf = [&](const char* name) {
    return cv::imread((keyframe / name).string()).size();
  };
  EXPECT_EQ(sizeOf("depth.png").width, 640);
  EXPECT_EQ(sizeOf("confidence.png"), sizeOf("depth.png"));
  MapOutput output(folder() / "out", OutputKind::kMap, {}, PictureStyle::kPlain);
  output.writeKeyframe(small);
  EXPECT_EQ(sizeOf("depth.png"), cv::Size(4, 3));
  EXPECT_EQ(sizeOf("confidence.png"), cv::Size(4, 3));
  output.writeTrajectory("trajectory.txt", {{small.window.t_ref_ns, small.T_world_ref}});
  EXPECT_THAT(readText(folder() / "out" / "trajectory.txt"),
              HasSubstr("1700000000.123456789 1 2 3 0 0 0 1\n"));
}

TEST_F(MapOutputTest, OfAKeyframeThatCannotBeWrittenNothingStays) {
  const auto keyframe = folder() / "out" / "keyframes" / "1.000000000";
  MapOutput output(folder() / "out", OutputKind::kMap, {});
  std::filesystem::create_directories(keyframe / "points.png");  // in the place of a later file
  std::filesystem::create_directories(keyframe / "depth.png");
  EXPECT_ANY_THROW(output.writeKeyframe(smallKeyframe(1'000'000'000)));
  for (const auto& entry : std::filesystem::directory_iterator(keyframe)) {
    EXPECT_TRUE(entry.is_directory()) << entry.path();
  }
}

TEST_F(MapOutputTest, TheFirstFileRemovesAnEarlierMapAlone) {
  const char* const earlier_files[] = {
      "map.pcd", "map.ply",      "map.simplemap", "map.html",
      "map.png", "overview.png", "report.json",   "keyframes/1.000000000/depth.tiff"};
  for (const char* name : earlier_files) writeFile(folder() / name, "of an earlier map");
  const auto keyframes = folder() / "keyframes";
  std::ofstream(folder() / "notes.txt") << "mine";
  std::ofstream(keyframes / "1.000000000" / "notes.txt") << "mine";
  std::filesystem::create_directory(keyframes / "2");  // this program writes times in another form
  std::ofstream(keyframes / "2" / "depth.tiff") << "mine";
  std::filesystem::create_directory(folder() / "elsewhere");
  std::ofstream(folder() / "elsewhere" / "depth.tiff") << "mine";
  std::filesystem::create_directory_symlink("../elsewhere", keyframes / "3.000000000");

  MapOutput output(folder(), OutputKind::kMap, {});
  EXPECT_TRUE(exists(folder() / "map.pcd")) << "nothing was written yet";
  EXPECT_TRUE(exists(folder() / "map.ply"));
  output.writeReport("{}");

  for (const char* name : earlier_files) {
    EXPECT_EQ(exists(folder() / name), name == std::string("report.json")) << name;
  }
  EXPECT_TRUE(exists(keyframes / "1.000000000" / "notes.txt"));
  EXPECT_TRUE(exists(folder() / "notes.txt"));
  EXPECT_TRUE(exists(keyframes / "2" / "depth.tiff"));
  EXPECT_TRUE(exists(folder() / "elsewhere" / "depth.tiff"));
}

TEST_F(MapOutputTest, AResultReplacesOneOfTheOtherKindAndNoFilesOfOthers) {
  const char* const kinds_files[] = {
      "map.pcd", "trajectory.txt", "keyframes/1.000000000/depth.tiff", "depth.tiff", "points.pcd"};
  const auto expectFiles = [&](bool of_map, bool of_depth) {
    for (std::size_t i = 0; i < 5; ++i) {
      EXPECT_EQ(exists(folder() / kinds_files[i]), i < 3 ? of_map : of_depth) << kinds_files[i];
    }
    EXPECT_EQ(MapOutput::holdsFilesOf(OutputKind::kMap, folder()), of_map);
    EXPECT_EQ(MapOutput::holdsFilesOf(OutputKind::kDepth, folder()), of_depth);
  };
  const auto writeMap = [&](const std::string& report = "") {
    MapOutput map(folder(), OutputKind::kMap, {});
    map.writeKeyframe(smallKeyframe(1'000'000'000));
    map.writeTrajectory("trajectory.txt", {});
    map.writeCloud("map.pcd", {});
    if (!report.empty()) map.writeReport(report);
  };
  const auto writeDepth = [&](const std::string& report) {
    MapOutput depth(folder(), OutputKind::kDepth, {});
    depth.writeImages(smallKeyframe(1'000'000'000));
    depth.writeCloud("points.pcd", MapCloud());
    if (!report.empty()) depth.writeReport(report);
  };
  const auto mark = folder() / "report.partial.json";
  EXPECT_FALSE(MapOutput::earlierResult(folder()));
  writeMap();
  EXPECT_TRUE(exists(mark));
  ASSERT_TRUE(MapOutput::earlierResult(folder())) << "of a killed run";
  expectFiles(true, false);
  writeDepth(R"({"version": "1", "options": {}, "keyframes": 3, "recording": ["a", "b"]})");
  EXPECT_FALSE(exists(mark));
  const auto result = MapOutput::earlierResult(folder());
  ASSERT_TRUE(result);
  EXPECT_TRUE(result->complete);
  EXPECT_EQ(result->keyframes, 3U);
  EXPECT_TRUE(result->isOf({"a", "b"}));
  EXPECT_FALSE(result->isOf({"b", "a"}));
  EXPECT_FALSE(result->isOf({"a"}));
  expectFiles(false, true);
  writeMap();
  expectFiles(false, true);  // a run without a report leaves only this file
  EXPECT_FALSE(exists(mark));
  EXPECT_FALSE(exists(folder() / "keyframes"));
  writeMap("{}");
  expectFiles(true, false);
  for (const char* foreign : {"", "{}", "[1]", R"({"version": "1", "options": {}})", "text"}) {
    std::ofstream(folder() / "report.json") << foreign;
    EXPECT_FALSE(MapOutput::earlierResult(folder())) << foreign;
  }
  writeDepth("{}");
  expectFiles(true, true);
  for (const char* foreign : {"", "{}", "[1]", R"({"process": 1})"}) {
    std::ofstream(mark) << foreign;
    EXPECT_FALSE(MapOutput::earlierResult(folder())) << foreign;
  }
}

TEST_F(MapOutputTest, OneRunAtATimeWritesAFolder) {
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t other = fork();
  if (other == 0) {
    MapOutput output(folder(), OutputKind::kMap, {}, {}, {"/data/a.rawlog"});
    output.writeKeyframe(smallKeyframe(1'000'000'000));
    output.writeKeyframe(smallKeyframe(2'000'000'000));
    const AtomicFile unfinished(folder() / "map.pcd");
    static_cast<void>(write(ready[1], "x", 1));
    pause();
    _exit(1);
  }
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  const std::string at_work = folder().string() + ": another run is writing its result there";
  EXPECT_THAT(messageOf([&] { MapOutput::earlierResult(folder()); }), HasSubstr(at_work));
  EXPECT_THAT(messageOf([&] { MapOutput(folder(), OutputKind::kMap, {}); }), HasSubstr(at_work));
  EXPECT_THAT(messageOf([&] { RunMark(folder(), {}); }), HasSubstr(at_work)) << "at the same time";
  kill(other, SIGKILL);
  waitpid(other, nullptr, 0);

  const std::string number = std::to_string(other);
  const auto left = folder() / ("map.partial-" + number + ".pcd");
  EXPECT_TRUE(exists(left));
  const auto killed = MapOutput::earlierResult(folder());
  ASSERT_TRUE(killed);
  EXPECT_FALSE(killed->complete);
  EXPECT_EQ(killed->keyframes, 2U);
  EXPECT_TRUE(killed->isOf({"/data/a.rawlog"}));
  const std::string others[] = {"map.partial.pcd", "map.partial-" + number + "0.pcd",
                                "notes.partial-" + number + ".txt"};
  for (const std::string& name : others) std::ofstream(folder() / name) << "mine";
  MapOutput output(folder(), OutputKind::kMap, {});
  EXPECT_FALSE(exists(left));
  EXPECT_TRUE(exists(folder() / "keyframes" / "2.000000000")) << "nothing was written yet";
  output.writeKeyframe(smallKeyframe(3'000'000'000));
  EXPECT_FALSE(exists(folder() / "keyframes" / "2.000000000"));
  for (const std::string& name : others) EXPECT_TRUE(exists(folder() / name)) << name;
  EXPECT_THAT(messageOf([&] { MapOutput(folder(), OutputKind::kDepth, {}); }), HasSubstr(at_work));
  output.writeReport("{}");
  EXPECT_NO_THROW(MapOutput(folder(), OutputKind::kMap, {}));
}

TEST_F(MapOutputTest, AnErrorNamesAFolderThatCannotBeMade) {
  std::ofstream(folder() / "out") << "a file";
  EXPECT_THAT(messageOf([&] { MapOutput(folder() / "out", OutputKind::kMap, {}); }),
              HasSubstr((folder() / "out").string()));
  EXPECT_THAT(messageOf([&] { MapOutput("", OutputKind::kMap, {}); }),
              HasSubstr("'': expected the name of the folder"));
}

class NpyFileTest : public TemporaryFolder {};

TEST_F(NpyFileTest, HoldsPlanesRowsAndColumnsInThatOrder) {
  const ReferenceView view{3, 2, 1, 1, 0, 0};
  NpyDsiFile file(folder() / "dsi.npy", 2, view);
  const std::vector<float> far = {6, 7, 8, 9, 10, 11};
  const std::vector<float> near = {0, 1, 2, 3, 4, 5};
  file.addPlane(1, far.data());
  EXPECT_FALSE(exists(folder() / "dsi.npy")) << "not complete";
  file.addPlane(0, near.data());
  file.finish()->replace();

  const std::string content = readText(folder() / "dsi.npy");
  const NpyHeader header = parseNpyHeader(content);
  EXPECT_EQ(header.descr, "<f4");
  EXPECT_FALSE(header.fortran_order);
  EXPECT_THAT(header.shape, ElementsAre(2, 2, 3));
  EXPECT_EQ(header.data_begin % 64, 0U);
  ASSERT_EQ(content.size(), header.data_begin + 12 * sizeof(float));
  std::vector<float> values(12);
  std::memcpy(values.data(), content.data() + header.data_begin, 12 * sizeof(float));
  EXPECT_THAT(values, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11));
}

TEST_F(NpyFileTest, LeavesNothingWithoutFinish) {
  { NpyDsiFile file(folder() / "dsi.npy", 1, {1, 1, 1, 1, 0, 0}); }
  EXPECT_TRUE(std::filesystem::is_empty(folder()));
  EXPECT_THROW(NpyDsiFile(folder() / "nowhere" / "dsi.npy", 1, {1, 1, 1, 1, 0, 0}),
               std::runtime_error);
}

/// Limits the size of this process's files, like a full disk.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

TEST_F(NpyFileTest, ThatDoesNotFitTheDiskIsAnErrorAndLeavesNothing) {
  for (const int side : {8, 400}) {  // small data are written at the end, large data at once
    const FileSizeLimit limit(200);
    const ReferenceView view{side, side, 1, 1, 0, 0};
    const std::vector<float> plane(view.pixels(), 1.5F);
    NpyDsiFile file(folder() / "dsi.npy", 1, view);
    file.addPlane(0, plane.data());
    EXPECT_THROW(file.finish(), std::runtime_error) << side;
    EXPECT_FALSE(exists(folder() / "dsi.npy")) << side;
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder()));
}

KeyframeDepthMap keyframeAt(std::int64_t t_ref_ns) {
  KeyframeDepthMap keyframe;
  keyframe.window.t_ref_ns = t_ref_ns;
  return keyframe;
}

/// A writer that waits until the gate is opened.
struct Gate {
  std::promise<void> promise;
  std::shared_future<void> opened = promise.get_future().share();
  std::vector<std::int64_t> written;

  KeyframeWriter::Write write() {
    return [this](const KeyframeDepthMap& keyframe) {
      opened.wait();
      if (keyframe.window.t_ref_ns == 13) throw std::runtime_error("keyframe 13 cannot be written");
      written.push_back(keyframe.window.t_ref_ns);
    };
  }
};

TEST(KeyframeWriter, WritesInOrderBesideItsCallerWhoWaitsWhereTooManyWait) {
  Gate gate;
  KeyframeWriter writer(gate.write());
  std::atomic<int> added = 0;
  std::thread caller([&] {
    for (const int t : {1, 2, 3, 4, 5, 6}) {
      writer.add(keyframeAt(t));
      ++added;
    }
    writer.finish();
  });
  while (added < 1) std::this_thread::yield();
  EXPECT_LE(added, 2) << "one is being written and one waits";
  gate.promise.set_value();
  caller.join();
  EXPECT_THAT(gate.written, ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_GT(writer.cpuSeconds(), 0);
}

TEST(KeyframeWriter, AnErrorReachesTheCallerAndNothingMoreIsWritten) {
  Gate gate;
  KeyframeWriter writer(gate.write());
  for (const int t : {12, 13}) writer.add(keyframeAt(t));
  gate.promise.set_value();
  const std::string message = messageOf([&] {
    for (int t = 14; t < 1000; ++t) writer.add(keyframeAt(t));
  });
  EXPECT_EQ(message, "keyframe 13 cannot be written");
  EXPECT_EQ(messageOf([&] { writer.finish(); }), message);
  EXPECT_THAT(gate.written, ElementsAre(12));
}

TEST(KeyframeWriter, WritesTheWaitingKeyframesWhenItIsDestroyed) {
  Gate gate;
  {
    KeyframeWriter writer(gate.write());
    for (const int t : {1, 2}) writer.add(keyframeAt(t));
    gate.promise.set_value();
  }
  EXPECT_THAT(gate.written, ElementsAre(1, 2));
}

}  // namespace

}  // namespace efm
