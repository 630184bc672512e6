// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/text/uzh_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/obs/CObservationRobotPose.h>

#include <opencv2/imgcodecs.hpp>
#include <string>

#include "plugin/formats/open_recording.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/mrpt/mrpt_time.h"
#include "test/paths.h"
#include "test/plugin/formats/files.h"
#include "test/plugin/formats/open_as.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

class UzhText : public TemporaryFolder {
 protected:
  UzhText() {
    write("events.txt", "0.1 239 179 1\n");
    write("groundtruth.txt", "0 1 2 3 0 0 0 1\n");
    write("calib.txt", "200 201 120 90 0 0 0 0 0\n");
  }
  void write(const std::string& name, const std::string& text) const {
    writeFile(folder() / name, text);
  }
  void remove(const std::string& name) const { std::filesystem::remove(folder() / name); }
  std::string errorOfOpening() const {
    return errorOf([&] { openAs("uzh", folder()); });
  }
  std::string sizeFound() const {
    const CameraSize size = uzhSensorSize(folder());
    return std::to_string(size.width) + "x" + std::to_string(size.height);
  }
};

TEST_F(UzhText, CalibrationIsRadtanEvenIfAllCoefficientsAreZero) {
  const CameraModel model = readUzhCalibration(folder() / "calib.txt", {240, 180});
  EXPECT_EQ(model.fx, 200);
  EXPECT_EQ(model.fy, 201);
  EXPECT_EQ(model.cx, 120);
  EXPECT_EQ(model.cy, 90);
  EXPECT_EQ(model.distortion, DistortionModel::kRadtan);
  EXPECT_THAT(model.coefficients, ElementsAre(0, 0, 0, 0, 0));
}

TEST_F(UzhText, AWrongCountOfNumbersIsAnErrorThatNamesTheCount) {
  write("calib.txt", "200 201 120 90 0 0 0 0\n");
  EXPECT_THAT(errorOfOpening(),
              AllOf(HasSubstr("calib.txt: 8 numbers: expected 9"), HasSubstr("k1 k2 p1 p2 k3")));
  write("calib.txt", "200 201 120 90 0 0 0 0 0 0\n");
  EXPECT_THAT(errorOfOpening(), HasSubstr("calib.txt: 10 numbers: expected 9"));
  write("calib.txt", "");
  EXPECT_THAT(errorOfOpening(), HasSubstr("calib.txt: 0 numbers: expected 9"));
}

TEST_F(UzhText, WrongNumbersOfACalibrationAreErrors) {
  write("calib.txt", "200 201 120 90\nk1 0 0 0 0\n");
  EXPECT_THAT(errorOfOpening(), HasSubstr("calib.txt:2: 'k1': expected a finite number"));
  write("calib.txt", "\x1b[2J 201 120 90\n");
  EXPECT_THAT(errorOfOpening(), HasSubstr("calib.txt:1: '\\x1b[2J': expected a finite number"));
  write("calib.txt", "0 201 120 90 0 0 0 0 0\n");
  EXPECT_THAT(errorOfOpening(), AllOf(HasSubstr("calib.txt: fx = 0"), HasSubstr("above 0")));
}

TEST_F(UzhText, TheSensorIsADavis240WithoutImages) {
  EXPECT_EQ(sizeFound(), "240x180");
  write("images.txt", "0.0 images/frame_0.png\n");
  EXPECT_EQ(sizeFound(), "240x180");
}

TEST_F(UzhText, TheSensorHasTheSizeOfTheFirstExistingImage) {
  write("images.txt", "# t file\n0.0 images/frame_0.png\n0.1 images/frame_1.png\n");
  std::filesystem::create_directories(folder() / "images");
  cv::imwrite((folder() / "images" / "frame_1.png").string(), cv::Mat::zeros(260, 346, CV_8UC1));
  EXPECT_EQ(sizeFound(), "346x260");
  write("events.txt", "0.1 345 259 1\n");
  EXPECT_NO_THROW(openAs("uzh", folder()));
}

TEST_F(UzhText, AnImageThatCannotBeReadIsAnError) {
  write("images.txt", "0.0 frame.png\n");
  write("frame.png", "not an image");
  EXPECT_THAT(errorOfOpening(), HasSubstr("frame.png: cannot be read as an image"));
}

TEST_F(UzhText, AMissingFileIsNamed) {
  EXPECT_TRUE(looksLikeUzhFolder(folder()));
  remove("groundtruth.txt");
  EXPECT_THAT(errorOfOpening(), HasSubstr(": no poses: expected groundtruth.txt, or --poses FILE"));
  remove("calib.txt");
  EXPECT_THAT(errorOfOpening(),
              HasSubstr(": no calibration: expected calib.txt, or --calibration FILE"));
  remove("events.txt");
  EXPECT_FALSE(looksLikeUzhFolder(folder()));
  EXPECT_FALSE(looksLikeUzhFolder(folder() / "nowhere"));
}

TEST_F(UzhText, WithoutPosesOrEventsIsAnError) {
  write("groundtruth.txt", "\n");
  EXPECT_THAT(errorOfOpening(), HasSubstr("groundtruth.txt: no poses"));
  write("groundtruth.txt", "0 1 2 3 0 0 0 1\n");
  write("events.txt", "");
  EXPECT_THAT(errorOfOpening(), HasSubstr("events.txt: no events"));
}

TEST(UzhSliderDepth, IsReadWhole) {
  const std::filesystem::path folder = EFM_SHARED_DATA "/slider_depth";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";
  ASSERT_TRUE(looksLikeUzhFolder(folder));
  const auto recording = openAs("uzh", folder);
  std::vector<Event> events;
  std::size_t poses = 0;
  std::int64_t newest_ns = 0;
  while (const auto observation = recording->next()) {
    const std::int64_t t_ns = nanosecondsFrom(observation->timestamp);
    EXPECT_GE(t_ns, newest_ns);
    newest_ns = t_ns;
    if (const auto* packet = dynamic_cast<const CObservationEvents*>(observation.get())) {
      EXPECT_EQ(packet->camera.width, 240);
      EXPECT_EQ(packet->camera.height, 180);
      EXPECT_EQ(packet->camera.fx, 335.419462958);
      EXPECT_EQ(packet->camera.coefficients.size(), 5U);
      events.insert(events.end(), packet->events.begin(), packet->events.end());
    } else {
      ++poses;
    }
  }
  ASSERT_EQ(events.size(), 50'000U);
  EXPECT_TRUE((events.front() == Event{3'811'000, 96, 133, false}));
  EXPECT_TRUE((events.back() == Event{174'156'000, 70, 103, true}));
  EXPECT_EQ(poses, 339U);
  EXPECT_EQ(recording->counts().sorted_events, 0U);
  EXPECT_EQ(recording->progress(), 1.0);
}

}  // namespace
}  // namespace efm
