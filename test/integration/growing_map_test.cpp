// SPDX-License-Identifier: BSD-3-Clause
// `map --record-frames`: the growing map is drawn without a screen.
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "test/plugin/program_test.h"

namespace efm {
namespace {

using testing::HasSubstr;

class GrowingMap : public ProgramTest {
 protected:
  /// The pixels of the cloud: the left part of a frame, where a colour is no grey.
  int cloudPixelsIn(const std::string& frame) const {
    const cv::Mat3b picture = cv::imread((folder() / frame).string());
    EXPECT_EQ(picture.size(), cv::Size(1280, 720)) << frame;
    if (picture.empty()) return 0;
    const cv::Mat3b left = picture.colRange(0, 960);
    return static_cast<int>(std::count_if(left.begin(), left.end(), [](const cv::Vec3b& colour) {
      const auto [least, most] = std::minmax({colour[0], colour[1], colour[2]});
      return most - least > 80;
    }));
  }
};

TEST_F(GrowingMap, HasAFrameForEachKeyframeAndTheSameResult) {
  write(SyntheticRecording());
  const std::string map = mapOf("data");
  const std::string frames = "env -u DISPLAY '" EFM_EVENT_FUSION "' map rig.ini data --out out2 ";

  Result result = shell(frames + "--record-frames new/frames");

  ASSERT_EQ(result.status, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("keyframes   3\n"));
  EXPECT_THAT(filesIn("new/frames"),
              testing::ElementsAre("frame_000001.png", "frame_000002.png", "frame_000003.png"));
  EXPECT_EQ(contentOf("out2/map.pcd"), map);
  const int first = cloudPixelsIn("new/frames/frame_000001.png");
  EXPECT_GT(first, 100);
  EXPECT_GT(cloudPixelsIn("new/frames/frame_000003.png"), first);

  write("new/frames/frame_000009.png", "of an earlier run");
  EXPECT_EQ(shell(frames + "--record-frames new/frames").status, 0);
  EXPECT_EQ(filesIn("new/frames").size(), 3U);
}

TEST_F(GrowingMap, RefusesFoldersThatItMustNotTouch) {
  write(SyntheticRecording());
  write("photos/photo.png", "mine");
  write("file", "no folder");
  for (const auto& [folder, why] : std::vector<std::pair<std::string, std::string>>{
           {"photos", "photos: holds other files than frames"},
           {"data", "data: it is the input"},
           {"file", "file"}}) {
    const Result result = run("map rig.ini data --out out --record-frames " + folder);
    EXPECT_EQ(result.status, 1) << folder;
    EXPECT_THAT(result.err, HasSubstr(why));
    EXPECT_FALSE(exists(this->folder() / "out")) << "before the mapping";
  }
  EXPECT_EQ(contentOf("photos/photo.png"), "mine");
}

}  // namespace
}  // namespace efm
