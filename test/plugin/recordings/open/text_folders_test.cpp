// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/text/dataset_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>

#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/recordings/open/open_recording.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// Opens one file or folder in a format.
std::unique_ptr<Recording> openAs(const std::string& format, const std::filesystem::path& path) {
  RecordingSource source;
  source.files = {path};
  source.format = format;
  return openRecording(source);
}

class TextFolder : public TemporaryFolder {
 protected:
  explicit TextFolder(std::string format) : format_(std::move(format)) {}
  void write(const std::string& name, const std::string& text) const {
    writeFile(folder() / name, text);
  }
  void remove(const std::string& name) const { std::filesystem::remove(folder() / name); }
  std::string errorOfOpening() const {
    return errorOf([&] { openAs(format_, folder()); });
  }

 private:
  std::string format_;
};

class DatasetFolder : public TextFolder {
 protected:
  DatasetFolder() : TextFolder("folder") {
    std::string camchain;
    for (const char* name : {"cam0", "cam1"}) {
      camchain += std::string(name) +
                  ":\n  camera_model: pinhole\n  intrinsics: [200, 200, 120, 90]\n"
                  "  distortion_model: none\n  resolution: [240, 180]\n"
                  "  T_cn_cnm1: [[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n";
    }
    write("camchain.yaml", camchain);
    write("cam0/events.txt", "0.1 239 179 1\n");
    write("cam1/events.txt", "0.2 0 0 0\n");
    write("poses.txt", "0.3 1 2 3 0 0 0 1\n0.0 0 2 3 0 0 0 1\n");
  }
};

TEST_F(DatasetFolder, ReturnsEventsOfEachCameraAndPosesInOrder) {
  EXPECT_TRUE(looksLikeDatasetFolder(folder()));
  const auto recording = openAs("folder", folder());
  std::string labels;
  while (const auto observation = recording->next()) {
    labels += observation->sensorLabel + " ";
    const auto* packet = dynamic_cast<const CObservationEvents*>(observation.get());
    if (packet != nullptr && packet->camera_index == 1) {
      EXPECT_NEAR(packet->camera_pose.x(), 0.1, 1e-15);
    }
  }
  EXPECT_EQ(labels, "pose cam0 cam1 cam0 cam1 pose ");
  write("cam7/events.txt", "nonsense\n");
  write("notes.txt", "nonsense\n");
  std::filesystem::rename(folder() / "poses.txt", folder() / "groundtruth.txt");
  EXPECT_EQ(openAs("folder", folder())->next()->sensorLabel, "pose");
}

TEST_F(DatasetFolder, AFileThatIsMissingOrWrongIsNamed) {
  write("cam2/events.txt", "0.2 0 0 0\n");
  EXPECT_THAT(errorOfOpening(),
              HasSubstr("camchain.yaml: 2 cameras: expected 3, because the folder "
                        "has events of cam0 to cam2"));
  remove("cam1/events.txt");
  EXPECT_THAT(errorOfOpening(), HasSubstr("cam1/events.txt: cannot be opened"));
  write("cam1/events.txt", "0.3 240 0 0\n");
  remove("cam2/events.txt");
  EXPECT_THAT(errorOfOpening(), AllOf(HasSubstr("cam1/events.txt:1: "), HasSubstr("'240'")));
  write("cam1/events.txt", "0.2 0 0 0\n");
  write("poses.txt", "0.3 1 2 3 0 0 0 1\n0.4 1 2 3\n");
  EXPECT_THAT(errorOfOpening(), HasSubstr("poses.txt:2: "));
  remove("poses.txt");
  remove("camchain.yaml");
  EXPECT_TRUE(looksLikeDatasetFolder(folder()));
  remove("cam0/events.txt");
  for (const char* name : {"", "cam1/events.txt", "nowhere"}) {
    EXPECT_FALSE(looksLikeDatasetFolder(folder() / name)) << name;
  }
}

TEST_F(DatasetFolder, ADamagedListOfTheTruthStopsOnlyWhoAsksForIt) {
  RecordingSource source;
  source.files = {folder()};
  EXPECT_TRUE(openTruth(source).empty());
  write("depth/index.txt", "# t file\n10.3 a.tiff\n");
  const std::vector<TruthDepth> truth = openTruth(source);
  ASSERT_EQ(truth.size(), 1U);
  EXPECT_EQ(truth[0].t_ns, 10'300'000'000);
  EXPECT_EQ(truth[0].file, folder() / "depth" / "a.tiff");
  write("depth/index.txt", "0.3 a.tiff\nsoon b.tiff\n");
  EXPECT_NO_THROW(openAs("folder", folder()));
  EXPECT_THAT(errorOf([&] { openTruth(source); }), HasSubstr("index.txt:2: 'soon b.tiff'"));
}

class UzhText : public TextFolder {
 protected:
  UzhText() : TextFolder("uzh") {
    write("events.txt", "0.1 239 179 1\n");
    write("groundtruth.txt", "0 1 2 3 0 0 0 1\n");
    write("calib.txt", "200 201 120 90 0 0 0 0 0\n");
  }
  std::string sizeFound() const {
    const CameraSize size = uzhSensorSize(folder());
    return std::to_string(size.width) + "x" + std::to_string(size.height);
  }
};

TEST_F(UzhText, TheSensorHasTheSizeOfTheFirstExistingImageElseThatOfADavis240) {
  EXPECT_EQ(sizeFound(), "240x180");
  write("images.txt", "# images/frame_1.png\n0.0 images/frame_0.png\n0.1 images/frame_1.png\n");
  EXPECT_EQ(sizeFound(), "240x180");
  std::filesystem::create_directories(folder() / "images");
  cv::imwrite((folder() / "images" / "frame_1.png").string(), cv::Mat::zeros(260, 346, CV_8UC1));
  EXPECT_EQ(sizeFound(), "346x260");
  write("events.txt", "0.1 345 259 1\n");
  EXPECT_NO_THROW(openAs("uzh", folder()));
  write("images/frame_0.png", "not an image");
  EXPECT_THAT(errorOfOpening(), HasSubstr("frame_0.png: cannot be read as an image"));
}

TEST_F(UzhText, AMissingFileIsNamed) {
  EXPECT_TRUE(looksLikeUzhFolder(folder()));
  write("groundtruth.txt", "\n");
  EXPECT_THAT(errorOfOpening(), HasSubstr("groundtruth.txt: no poses"));
  remove("groundtruth.txt");
  EXPECT_THAT(errorOfOpening(), HasSubstr(": no poses: expected groundtruth.txt, or --poses FILE"));
  remove("calib.txt");
  EXPECT_THAT(errorOfOpening(),
              HasSubstr(": no calibration: expected calib.txt, or --calibration FILE"));
  remove("events.txt");
  EXPECT_FALSE(looksLikeUzhFolder(folder()));
  EXPECT_FALSE(looksLikeUzhFolder(folder() / "nowhere"));
}

}  // namespace
}  // namespace efm
