// SPDX-License-Identifier: BSD-3-Clause
// Tests that `map --record-frames` draws the growing map without a screen, and `map --view` in a
// window.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "plugin/recordings/open/recording_formats.h"
#include "test/integration/letter_f.h"
#include "test/plugin/program_test.h"

namespace efm {
namespace {

using testing::HasSubstr;

class GrowingMap : public ProgramTest {
 protected:
  /// Returns the number of coloured pixels in the left part of a frame, which shows the cloud.
  int cloudPixelsIn(const std::string& frame) const {
    const cv::Mat3b picture = cv::imread((folder() / frame).string());
    EXPECT_EQ(picture.size(), cv::Size(1280, 720)) << frame;
    if (picture.empty()) return 0;
    return colouredIn(cv::Mat3b(picture.colRange(0, 960)));
  }
  template <typename Colour>
  static int colouredIn(const cv::Mat_<Colour>& picture) {
    return static_cast<int>(std::count_if(picture.begin(), picture.end(), isColour<Colour>));
  }
  static cv::Mat1b colours(const cv::Mat3b& picture) {
    cv::Mat1b mask(picture.size());
    std::transform(picture.begin(), picture.end(), mask.begin(),
                   [](const cv::Vec3b& colour) { return isColour(colour) ? 255 : 0; });
    return mask;
  }
  template <typename Colour>
  static bool isColour(const Colour& colour) {
    const auto [least, most] = std::minmax({colour[0], colour[1], colour[2]});
    return most - least > 80;
  }
  std::vector<StampedPose> posesOfMap() const {
    return readPoses(folder() / "out" / "trajectory.txt");
  }

  /// Reads the screen of Xvfb from its file: a header of big-endian words, then 4 bytes per pixel.
  static cv::Mat4b screenIn(std::string dump) {
    const auto word = [&](std::size_t index) {
      std::uint32_t value = 0;
      for (std::size_t i = 0; i < 4; ++i) {
        value = value << 8 | static_cast<unsigned char>(dump.at(4 * index + i));
      }
      return value;
    };
    const std::size_t header = word(0) + std::size_t{12} * word(19);  // with the table of colours
    const int columns = static_cast<int>(word(4));
    const int rows = static_cast<int>(word(5));
    if (dump.size() < header + std::size_t{word(12)} * static_cast<std::size_t>(rows)) return {};
    return cv::Mat4b(cv::Mat(rows, columns, CV_8UC4, dump.data() + header, word(12)).clone());
  }
};

TEST_F(GrowingMap, HasAFrameForEachKeyframeAndTheSameResult) {
  write(SyntheticRecording());
  const std::string map = mapOf("data");
  const std::string frames = "env -u DISPLAY '" EFM_EVENT_FUSION "' map rig.ini data --out out2 ";

  Result result = shell(frames + "--record-frames new/frames");

  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("keyframes   4\n"));
  EXPECT_THAT(filesIn("new/frames"), testing::ElementsAre("frame_000001.png", "frame_000002.png",
                                                          "frame_000003.png", "frame_000004.png"));
  EXPECT_EQ(contentOf("out2/map.pcd"), map);
  const int first = cloudPixelsIn("new/frames/frame_000001.png");
  EXPECT_GT(first, 100);
  EXPECT_GT(cloudPixelsIn("new/frames/frame_000004.png"), first);

  write("new/frames/frame_000009.png", "of an earlier run");
  EXPECT_EQ(shell(frames + "--record-frames new/frames --t0 1000 --t1 1001").status, 1);
  EXPECT_EQ(filesIn("new/frames").size(), 5U) << "no frame takes their place";
  EXPECT_EQ(shell(frames + "--record-frames new/frames").status, 0);
  EXPECT_EQ(filesIn("new/frames").size(), 4U);
}

/// Returns dots of an F before the cameras, 0.6 m wide, 1.2 m high, upright in the cameras' view.
SyntheticScene letterF() {
  SyntheticScene scene;
  std::mt19937 random(3);
  const auto stroke = [&](double x0, double x1, double y0, double y1, int count) {
    for (int i = 0; i < count; ++i) {
      const double u = random() / 4294967296.0;
      const double v = random() / 4294967296.0;
      scene.dots.emplace_back(x0 + u * (x1 - x0), y0 + v * (y1 - y0), SyntheticRecording::kDepthM);
    }
  };
  stroke(-0.1, 0.0, -0.6, 0.6, 40);  // y is down
  stroke(0.0, 0.5, -0.6, -0.5, 20);
  stroke(0.0, 0.3, -0.05, 0.05, 12);
  return scene;
}

TEST_F(GrowingMap, AnFStandsUprightInEveryPicture) {
  write(SyntheticRecording(0.5, 2, letterF()));
  ASSERT_EQ(shell("env -u DISPLAY '" EFM_EVENT_FUSION
                  "' map rig.ini data --out out --record-frames frames")
                .status,
            0);
  const auto picture = [this](const std::filesystem::path& file) {
    return cv::Mat3b(cv::imread((folder() / file).string()));
  };
  const std::string keyframe = "out/keyframes/" + formatSeconds(posesOfMap().at(0).t_ns);
  expectF(cv::imread((folder() / keyframe / "depth.tiff").string(), cv::IMREAD_UNCHANGED) > 0);

  const cv::Mat3b map = picture("out/map.png");
  expectF(colours(map({map.cols / 2, 0, map.cols - map.cols / 2, map.rows * 94 / 100})));
  const cv::Mat3b sheet = picture("out/overview.png");  // two by two keyframes and a colour bar
  for (const cv::Point& cell : {cv::Point(0, 0), {1, 0}, {0, 1}, {1, 1}}) {
    const cv::Size size(sheet.cols / 2, sheet.rows * 47 / 100);
    expectF(colours(sheet({{cell.x * size.width, cell.y * size.height}, size})));
  }

  const cv::Mat3b frame = picture("frames/frame_000004.png");
  for (const int top : {92, 423}) {  // depth above, confidence below
    cv::Mat1b ground;
    cv::inRange(frame({972, top, 294, 220}), cv::Scalar::all(255), cv::Scalar::all(255), ground);
    expectF(ground == 0);
  }
  cv::Mat1b high, low;  // in perspective, from behind the drawn camera: red and blue points
  const cv::Mat3b cloud = frame.colRange(0, 960);
  cv::inRange(cloud, cv::Scalar(0, 0, 150), cv::Scalar(60, 110, 255), high);
  cv::inRange(cloud, cv::Scalar(150, 0, 0), cv::Scalar(255, 150, 110), low);
  ASSERT_GT(cv::countNonZero(high), 50);
  ASSERT_GT(cv::countNonZero(low), 20);
  const cv::Rect arm = cv::boundingRect(high), foot = cv::boundingRect(low);
  EXPECT_LT(arm.br().y, foot.y) << "high is up";
  EXPECT_GT(arm.br().x, foot.br().x + 3 * foot.width) << "the arm points to the right";
  EXPECT_NEAR(arm.x, foot.x, foot.width);
}

TEST_F(GrowingMap, IsShownInAWindow) {
  if (shell("command -v xvfb-run").status != 0) GTEST_SKIP() << "there is no xvfb-run";
  std::filesystem::create_directories(folder() / "shots");
  int most = 0;
  // On a busy machine a short recording may be mapped before the window is drawn.
  for (int duration_s = 3; most <= 100 && duration_s <= 24; duration_s *= 2) {
    write(SyntheticRecording(duration_s));
    const std::string map = mapOf("data");
    // Copies the screen while the map grows.
    const Result result = shell(
        "xvfb-run -a -s '-screen 0 1280x720x24 -fbdir .' sh -c \""
        "'" EFM_EVENT_FUSION
        "' map rig.ini data --out out2 --view & map=\\$!; i=0; "
        "while kill -0 \\$map 2>/dev/null; do i=\\$((i + 1)); cp Xvfb_screen0 shots/\\$i; "
        "sleep 0.1; done; wait \\$map\"");

    ASSERT_EQ(result.status, 0) << result.err;
    EXPECT_EQ(contentOf("out2/map.pcd"), map);
    for (const std::string& shot : filesIn("shots")) {
      const cv::Mat4b screen = screenIn(contentOf("shots/" + shot));
      if (screen.empty()) continue;
      EXPECT_EQ(screen.size(), cv::Size(1280, 720));
      most = std::max(most, colouredIn(screen));
    }
  }
  EXPECT_GT(most, 100);
}

TEST_F(GrowingMap, NeedsADisplayForAWindow) {
  write(SyntheticRecording());
  const Result result =
      shell("env -u DISPLAY '" EFM_EVENT_FUSION "' map rig.ini data --out out --view");
  EXPECT_EQ(result.status, 1);
  EXPECT_THAT(result.err,
              testing::AllOf(HasSubstr("DISPLAY is not set"),
                             HasSubstr("--record-frames DIR renders without a screen")));
  EXPECT_FALSE(exists(folder() / "out")) << "before the mapping";
}

}  // namespace
}  // namespace efm
