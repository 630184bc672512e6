// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <sys/resource.h>
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

#include "mapping/base/npy_header.h"
#include "mapping/base/stage_times.h"
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
  MapOutput(folder(), {}).writeKeyframe(small);

  const auto keyframe = folder() / "keyframes" / "1700000000.123456789";
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
  const MapOutput output(folder(), {}, PictureStyle::kPlain);
  output.writeKeyframe(small);
  EXPECT_EQ(sizeOf("depth.png"), cv::Size(4, 3));
  EXPECT_EQ(sizeOf("confidence.png"), cv::Size(4, 3));
  output.writeTrajectory("trajectory.txt", {{small.window.t_ref_ns, small.T_world_ref}});
  EXPECT_THAT(readText(folder() / "trajectory.txt"),
              HasSubstr("1700000000.123456789 1 2 3 0 0 0 1\n"));
}

TEST_F(MapOutputTest, OfAKeyframeThatCannotBeWrittenNothingStays) {
  const auto keyframe = folder() / "keyframes" / "1.000000000";
  std::filesystem::create_directories(keyframe / "depth.png");  // in the place of a file
  EXPECT_THAT(
      messageOf([&] { MapOutput(folder(), {}).writeKeyframe(smallKeyframe(1'000'000'000)); }),
      HasSubstr("cannot write " + (keyframe / "depth.png").string()));
  EXPECT_FALSE(exists(keyframe));
}

class NpyFileTest : public TemporaryFolder {};

TEST_F(NpyFileTest, HoldsPlanesRowsAndColumnsInThatOrder) {
  const ReferenceView view{3, 2, 1, 1, 0, 0};
  NpyDsiFile file(folder() / "dsi.npy", 2, view);
  const std::vector<float> far = {6, 7, 8, 9, 10, 11};
  const std::vector<float> near = {0, 1, 2, 3, 4, 5};
  file.addPlane(1, far.data());
  file.addPlane(0, near.data());
  file.finish();

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

TEST_F(NpyFileTest, InAFolderThatDoesNotExistIsAnError) {
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

TEST_F(NpyFileTest, ThatDoesNotFitTheDiskIsAnError) {
  for (const int side : {8, 400}) {  // small data are written at the end, large data at once
    const FileSizeLimit limit(200);
    const ReferenceView view{side, side, 1, 1, 0, 0};
    const std::vector<float> plane(view.pixels(), 1.5F);
    NpyDsiFile file(folder() / "dsi.npy", 1, view);
    file.addPlane(0, plane.data());
    EXPECT_THROW(file.finish(), std::runtime_error) << side;
  }
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
  const double aside_s = asideSeconds();
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
  EXPECT_GT(asideSeconds(), aside_s);
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
