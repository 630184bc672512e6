// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/text/dataset_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/obs/CObservationRobotPose.h>

#include <string>

#include "plugin/formats/open_recording.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "test/plugin/formats/files.h"
#include "test/plugin/formats/open_as.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

class DatasetFolder : public TemporaryFolder {
 protected:
  DatasetFolder() {
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
  void write(const std::string& name, const std::string& text) const {
    writeFile(folder() / name, text);
  }
  void remove(const std::string& name) const { std::filesystem::remove(folder() / name); }

  std::string errorOfOpening() const {
    return errorOf([&] { openAs("folder", folder()); });
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
}

TEST_F(DatasetFolder, ReadsGroundtruthWithoutAPosesFile) {
  std::filesystem::rename(folder() / "poses.txt", folder() / "groundtruth.txt");
  EXPECT_EQ(openAs("folder", folder())->next()->sensorLabel, "pose");
}

TEST_F(DatasetFolder, OtherFilesAreIgnored) {
  write("cam7/events.txt", "nonsense\n");
  write("notes.txt", "nonsense\n");
  EXPECT_NO_THROW(openAs("folder", folder()));
}

TEST_F(DatasetFolder, IsDetectedByItsCalibrationOrItsFirstCamera) {
  remove("camchain.yaml");
  EXPECT_TRUE(looksLikeDatasetFolder(folder()));
  EXPECT_THAT(errorOfOpening(),
              HasSubstr(": no calibration: expected camchain.yaml, or --calibration FILE"));
  remove("cam0/events.txt");
  EXPECT_FALSE(looksLikeDatasetFolder(folder()));
  EXPECT_FALSE(looksLikeDatasetFolder(folder() / "poses.txt"));
  EXPECT_FALSE(looksLikeDatasetFolder(folder() / "nowhere"));
}

TEST_F(DatasetFolder, EventsOfACameraWithoutACalibrationAreAnError) {
  write("cam2/events.txt", "0.2 0 0 0\n");
  EXPECT_THAT(errorOfOpening(), HasSubstr("camchain.yaml: 2 cameras: expected 3, because"));
}

TEST_F(DatasetFolder, ACameraWithoutAFileIsAnError) {
  remove("cam1/events.txt");
  EXPECT_THAT(errorOfOpening(), HasSubstr("cam1/events.txt: cannot be opened"));
}

TEST_F(DatasetFolder, WithoutPosesIsAnErrorThatNamesTheExpectedFiles) {
  write("poses.txt", "# none\n");
  EXPECT_THAT(errorOfOpening(), HasSubstr("poses.txt: no poses"));
  remove("poses.txt");
  EXPECT_THAT(errorOfOpening(),
              AllOf(StartsWith(folder().string()),
                    HasSubstr("expected poses.txt or groundtruth.txt, or --poses FILE")));
}

TEST_F(DatasetFolder, ErrorsInAFileNameItAndTheLine) {
  write("poses.txt", "0.3 1 2 3 0 0 0 1\n0.4 1 2 3\n");
  EXPECT_THAT(errorOfOpening(), HasSubstr("poses.txt:2: "));
  write("cam1/events.txt", "0.2 0 0 0\n0.3 240 0 0\n");
  write("poses.txt", "0.3 1 2 3 0 0 0 1\n");
  const auto recording = openAs("folder", folder());
  EXPECT_THAT(errorOf([&] {
                while (recording->next()) {
                }
              }),
              AllOf(HasSubstr("cam1/events.txt:2: "), HasSubstr("'240'")));
  write("cam1/events.txt", "0.3 240 0 0\n");
  EXPECT_THAT(errorOfOpening(), AllOf(HasSubstr("cam1/events.txt:1: "), HasSubstr("'240'")));
}

TEST_F(DatasetFolder, ADamagedListOfTheTruthStopsOnlyWhoAsksForIt) {
  RecordingSource source;
  source.files = {folder()};
  EXPECT_TRUE(openTruth(source).empty());
  write("depth/index.txt", "# t file\n0.3 a.tiff\n");
  const std::vector<TruthDepth> truth = openTruth(source);
  ASSERT_EQ(truth.size(), 1U);
  EXPECT_EQ(truth[0].t_ns, 300'000'000);
  EXPECT_EQ(truth[0].file, folder() / "depth" / "a.tiff");
  write("depth/index.txt", "0.3 a.tiff\nsoon b.tiff\n");
  EXPECT_NO_THROW(openAs("folder", folder()));
  EXPECT_THAT(errorOf([&] { openTruth(source); }), HasSubstr("index.txt:2: 'soon b.tiff'"));
}

}  // namespace
}  // namespace efm
