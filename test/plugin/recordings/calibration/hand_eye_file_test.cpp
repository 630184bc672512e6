// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/calibration/calibration_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class HandEyeFile : public TemporaryFolder {
 protected:
  Rigid3 read(const std::string& text) const {
    writeFile(folder() / "hand_eye.yaml", text);
    return readHandEye(folder() / "hand_eye.yaml");
  }
  std::string errorOfText(const std::string& text) const {
    return errorOf([&] { read(text); });
  }
};

TEST_F(HandEyeFile, GivesTheTransformFromTheRigToTheBody) {
  // The rig looks along the body's x: its z is the body's x.
  const Rigid3 T_body_rig = read(
      "# a car\nT_body_rig:\n- [0, 0, 1, 0.4]\n- [-1, 0, 0, 0.2]\n- [0, -1, 0, -0.1]\n"
      "- [0, 0, 0, 1]\nnote: other keys do not matter\n");
  EXPECT_LT((T_body_rig * Eigen::Vector3d(0, 0, 2) - Eigen::Vector3d(2.4, 0.2, -0.1)).norm(),
            1e-12);
}

TEST_F(HandEyeFile, AnErrorNamesTheFileTheLineAndTheKey) {
  for (const char* text : {"", "5\n", "T_rig_body: 1\n", "0 0 0 0 0 0 1\n"}) {
    EXPECT_THAT(errorOfText(text),
                AllOf(HasSubstr("hand_eye.yaml: T_body_rig is missing: expected YAML"),
                      HasSubstr("4 rows of 4 numbers")))
        << text;
  }
  EXPECT_THAT(errorOfText("\nT_body_rig: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]\n"),
              HasSubstr("hand_eye.yaml:2: T_body_rig = a list: expected 4 rows of 4 numbers"));
  EXPECT_THAT(errorOf([&] { readHandEye(folder() / "nowhere"); }),
              HasSubstr("nowhere: cannot be opened"));
  EXPECT_THAT(errorOfText("cam0: {camera_model: pinhole}\n"),
              HasSubstr("hand_eye.yaml:1: cam0: T_cam_imu is missing"));
  EXPECT_THAT(errorOfText("cam0: {}\ncam2: {}\n"), HasSubstr("hand_eye.yaml: cam2 without cam1"));
}

TEST_F(HandEyeFile, OfTheImuIsThatOfTheCameraChain) {
  // T_cam_imu carries the IMU's point (5, 6, 7) to (-6, 5, 7) + (1, 2, 3).
  const Rigid3 T_imu_rig =
      read("cam0: {T_cam_imu: [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]}\n");
  EXPECT_LT((T_imu_rig * Eigen::Vector3d(-5, 7, 10) - Eigen::Vector3d(5, 6, 7)).norm(), 1e-12);
}

TEST_F(HandEyeFile, OfADataSetNeedsItsCalibration) {
  const char* const lidar =
      "T_lidar_camRect1: [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]\n";
  EXPECT_THAT(errorOfText(lidar), AllOf(HasSubstr("hand_eye.yaml"), HasSubstr("cam_to_cam.yaml")));
  const char* const marker =
      R"({"value0": {"T_imu_marker": {"px": 0, "py": 0, "pz": 0, "qx": 0, "qy": 0, "qz": 0, "qw": 1}}})";
  EXPECT_THAT(errorOfText(marker), HasSubstr("camera-calibration*.json"));
  EXPECT_THAT(errorOfText(R"({"value0": {"T_imu_marker": {"px": 0}}})"),
              AllOf(HasSubstr("value0: T_imu_marker: q"), HasSubstr(" is missing")));
  EXPECT_THAT(errorOfText(replaced(marker, R"("qx": 0)", R"("qx": 0.0458)")),  // length 1.00105
              HasSubstr("T_imu_marker: qx qy qz qw of length 1.00105: expected a rotation"));
}

}  // namespace
}  // namespace efm
