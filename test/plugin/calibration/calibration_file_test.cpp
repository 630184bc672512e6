// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/calibration/calibration_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/plugin/formats/files.h"
#include "test/plugin/message_of.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;

constexpr const char* kCamchain =
    "%YAML:1.0\n---\n"
    "cam0: {camera_model: pinhole, intrinsics: [200, 201, 120, 90], distortion_model: none,\n"
    "  resolution: [240, 180]}\n"
    "cam1: {camera_model: pinhole, intrinsics: [300, 301, 120, 90], distortion_model: none,\n"
    "  resolution: [240, 180],\n"
    "  T_cn_cnm1: [[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}\n";

class CalibrationFile : public TemporaryFolder {
 protected:
  Calibration read(const std::string& text) const {
    writeFile(folder() / "given.txt", text);
    return readCalibration(folder() / "given.txt");
  }
  std::string errorOfText(const std::string& text) const {
    return errorOf([&] { read(text); });
  }
};

TEST_F(CalibrationFile, MayBeACameraChainOfAnyName) {
  const Calibration calibration = read(kCamchain);
  const RigCamera camera = calibration.camera(1, CameraSize{240, 180});
  EXPECT_EQ(camera.model.fx, 300);
  EXPECT_NEAR(camera.T_rig_cam.translation.x(), 0.1, 1e-15);
  EXPECT_EQ(calibration.camera(0, std::nullopt).model.width, 240);
}

TEST_F(CalibrationFile, MayBeNineNumbersWhereTheRecordingKnowsTheSize) {
  const Calibration calibration = read("# fx fy\n200 201 120 90 0.1 0 0 0 0\n");
  const CameraModel model = calibration.camera(0, CameraSize{240, 180}).model;
  EXPECT_EQ(model.fy, 201);
  EXPECT_EQ(model.coefficients[0], 0.1);
  EXPECT_EQ(model.width, 240);
  EXPECT_EQ(model.height, 180);
  EXPECT_THAT(messageOf([&] { calibration.camera(0, std::nullopt); }),
              HasSubstr("given.txt: no size of the sensor"));
}

TEST_F(CalibrationFile, AnErrorOfOtherCamerasNamesTheFileAndBothCounts) {
  const Calibration calibration = read(kCamchain);
  EXPECT_THAT(messageOf([&] { calibration.camera(2, std::nullopt); }),
              EndsWith("given.txt: 2 cameras, but the recording has camera 2: expected one for "
                       "each"));
  EXPECT_THAT(messageOf([&] { calibration.requireCameras(3); }),
              EndsWith("given.txt: 2 cameras: expected 3, as the recording has"));
  EXPECT_THAT(messageOf([&] {
                calibration.camera(1, CameraSize{640, 480});
              }),
              EndsWith("given.txt: camera 1 has 240x180 pixels: expected 640x480 pixels, as the "
                       "recording has"));
  EXPECT_NO_THROW(calibration.requireCameras(2));
}

TEST_F(CalibrationFile, AnErrorNamesTheFileAndTheExpectedFormats) {
  EXPECT_THAT(errorOfText("{\"value0\": {}}\n"),
              AllOf(HasSubstr("given.txt: JSON"), HasSubstr("expected a camera chain")));
  EXPECT_THAT(errorOfText(""), HasSubstr("given.txt: cam0 is missing: expected a camera chain"));
  EXPECT_THAT(errorOfText("200 200 120\n"), HasSubstr("given.txt: 3 numbers: expected 9"));
  EXPECT_THAT(errorOf([&] { readCalibration(folder() / "nowhere"); }),
              EndsWith("nowhere: cannot be opened for reading"));
  EXPECT_THAT(errorOf([&] { readCalibration(folder()); }),
              EndsWith("cannot be opened for reading"));
}

}  // namespace
}  // namespace efm
