// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/calibration/calibration_formats.h"

#include <gmock/gmock.h>

#include <string>

#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

const std::string kCam0 = R"(cam0:
  camera_model: pinhole
  intrinsics: [200, 201, 120, 90]
  distortion_model: radtan
  distortion_coeffs: [-0.1, 0.02, 0.001, -0.002]
  resolution: [240, 180]
  rostopic: /cam0/events
)";
const std::string kCam1 = R"(cam1:
  camera_model: pinhole
  intrinsics: [210, 211, 121, 91]
  distortion_model: none
  distortion_coeffs: []
  resolution: [320, 240]
  T_cn_cnm1:
  - [0, -1, 0, 0.1]
  - [1, 0, 0, 0.2]
  - [0, 0, 1, 0.3]
  - [0, 0, 0, 1]
)";

class Camchain : public TemporaryFolder {
 protected:
  std::filesystem::path file() const { return folder() / "camchain.yaml"; }
  Rig read(const std::string& text) const {
    writeFile(file(), text);
    return readCamchain(file());
  }
  std::string errorOfText(const std::string& text) const {
    return messageOf([&] { read(text); });
  }
};

TEST_F(Camchain, HasEachCamerasModelAndPose) {
  const Rig rig =
      read("cam: 1\ncamera: 2\ncam1b: 3\n" + kCam0 +
           replaced(kCam1, "  distortion_coeffs: []\n", "") + replaced(kCam1, "cam1", "cam2"));
  ASSERT_EQ(rig.cameras.size(), 3U);
  CameraModel expected{240, 180, 200, 201, 120, 90, DistortionModel::kRadtan, {}};
  expected.coefficients = {-0.1, 0.02, 0.001, -0.002};
  EXPECT_EQ(rig.cameras[0].model, expected);
  expected = {320, 240, 210, 211, 121, 91, DistortionModel::kNone, {}};
  EXPECT_EQ(rig.cameras[1].model, expected);
  EXPECT_TRUE(isSame(rig.cameras[0].T_rig_cam, Rigid3()));
  // T_cn_cnm1 maps camera 0's point (1, 2, 3) to (-2, 1, 3) + (0.1, 0.2, 0.3) in camera 1, and this
  // point to (-1.2, -1.9, 3.3) + (0.1, 0.2, 0.3) in camera 2.
  const Eigen::Vector3d p_rig(1, 2, 3);
  const Eigen::Vector3d p_cam1(-1.9, 1.2, 3.3);
  const Eigen::Vector3d p_cam2(-1.1, -1.7, 3.6);
  EXPECT_LT((rig.cameras[1].T_rig_cam * p_cam1 - p_rig).norm(), 1e-12);
  EXPECT_LT((rig.cameras[2].T_rig_cam * p_cam2 - p_rig).norm(), 1e-12);
}

TEST_F(Camchain, MakesARoundedRotationExact) {
  const Rig rig = read(replaced(kCam0 + kCam1, "- [0, -1, 0, 0.1]", "- [0.0004, -0.9997, 0, 0.1]"));
  EXPECT_NEAR(rig.cameras[1].T_rig_cam.rotation.norm(), 1, 1e-15);
}

TEST_F(Camchain, ATimeOffsetIsTheTimeshiftMinusThatOfCameraZero) {
  const std::string shifted =
      replaced(kCam0, "  rostopic", "  timeshift_cam_imu: 0.00125\n  rostopic");
  const std::string cam2 = replaced(kCam1, "cam1", "cam2");
  const Rig rig = read(shifted + kCam1 + "  timeshift_cam_imu: -2.5e-4\n" + cam2 +
                       "  timeshift_cam_imu: 0.002\n");
  EXPECT_EQ(rig.cameras[0].time_offset_ns, 0);
  EXPECT_EQ(rig.cameras[1].time_offset_ns, -1'500'000);
  EXPECT_EQ(rig.cameras[2].time_offset_ns, 750'000);
  for (const std::string& half : {shifted + kCam1, kCam0 + kCam1 + "  timeshift_cam_imu: 1\n"}) {
    EXPECT_THAT(errorOfText(half), HasSubstr("cam1: timeshift_cam_imu"));
  }
  for (const char* wrong : {"1ms", "-4611686018.427387903"}) {  // kEndOfTimeNs
    EXPECT_THAT(errorOfText(kCam0 + "  timeshift_cam_imu: " + wrong + "\n"),
                HasSubstr(":8: cam0: timeshift_cam_imu = '" + std::string(wrong) +
                          "': expected a time in seconds"));
  }
}

TEST_F(Camchain, AnErrorNamesTheFile) {
  EXPECT_EQ(messageOf([&] { readCamchain(file()); }),
            file().string() + ": cannot be opened for reading");
  EXPECT_THAT(errorOfText("cam0:\n  intrinsics: [1, 2\n"),
              AllOf(StartsWith(file().string() + ":"), HasSubstr("not YAML")));
  for (const char* text : {"", "42", "[1, 2]", "left:\n  intrinsics: 3\n"}) {
    EXPECT_THAT(errorOfText(text), StartsWith(file().string() + ": cam0 is missing")) << text;
  }
  EXPECT_THAT(errorOfText(kCam0 + replaced(kCam1, "cam1", "cam2")),
              StartsWith(file().string() + ": cam2 without cam1"));
  EXPECT_THAT(errorOfText("cam0: 5\n"), HasSubstr("cam0: expected keys"));
}

TEST_F(Camchain, AnErrorNamesFileLineCameraAndKeyOfAWrongOrMissingValue) {
  const struct {
    const char* from;
    const char* to;
    const char* error;
  } cases[] = {
      {"[200, 201, 120, 90]", "[200, abc, 120, 90]",
       ":3: cam0: intrinsics = 'abc': expected finite numbers"},
      {"[200, 201, 120, 90]", "[200, .nan, 120, 90]",
       ":3: cam0: intrinsics = '.nan': expected finite numbers"},
      {"[200, 201, 120, 90]", "200", ":3: cam0: intrinsics = '200': expected 4, fx fy cx cy"},
      {"[200, 201, 120, 90]", "[200, 201, 120]",
       ":3: cam0: intrinsics: 3 numbers: expected 4, fx fy cx cy"},
      {"[200, 201, 120, 90]", "[-200, 201, 120, 90]",
       ": cam0: fx = -200: must be finite and above 0"},
      {"[320, 240]", "[320]", ":13: cam1: resolution: 1 numbers: expected 2, width height"},
      {"[320, 240]", "[320, 240.5]", "cam1: resolution = 240.5: expected whole numbers from 1"},
      {"[320, 240]", "[0, 240]", "cam1: resolution = 0: expected whole numbers from 1 to 65535"},
      {"[320, 240]", "[320, 65536]", "cam1: resolution = 65536: expected whole numbers from 1"},
      {"pinhole", "[pinhole]", ":2: cam0: camera_model: expected a word"},
      {"pinhole", "", ": cam0: camera_model: expected a word"},
      {"pinhole", "omni", ":2: cam0: camera_model = 'omni': expected pinhole"},
      {"radtan", "fov", ":4: cam0: distortion_model = 'fov': expected radtan (plumb_bob"},
      {"0.02, 0.001, -0.002]", "0.02, 0.001]",
       ": cam0: number of distortion coefficients = 3: must be 4 or 5"},
      {"distortion_coeffs: []", "distortion_coeffs: [0, 0, 0, 0.1]",
       ": cam1: number of distortion coefficients = 4: must be 0"},
      {"- [0, -1, 0, 0.1]", "- [0, -1.01, 0, 0.1]",
       "cam1: T_cn_cnm1 = a matrix whose columns are off orthonormal by 0.0201"},
      {"- [0, -1, 0, 0.1]", "- [0, 1, 0, 0.1]",
       "cam1: T_cn_cnm1 = a reflection: expected a rotation"},
      {"- [0, 0, 0, 1]", "- [0, 0, 0.5, 1]",
       "cam1: T_cn_cnm1 = a matrix with another last row: expected 0 0 0 1 there"},
      {"- [0, 0, 0, 1]\n", "", "cam1: T_cn_cnm1: 12 numbers: expected 4 rows of 4 numbers"},
      {"- [0, 0, 1, 0.3]", "- [0, 0, 1]",
       "cam1: T_cn_cnm1: 15 numbers: expected 4 rows of 4 numbers"},
  };
  for (const auto& row : cases) {
    EXPECT_THAT(errorOfText(replaced(kCam0 + kCam1, row.from, row.to)),
                AllOf(StartsWith(file().string() + ":"), HasSubstr(row.error)));
  }
  for (const std::string key : {"camera_model", "intrinsics", "distortion_model",
                                "distortion_coeffs", "resolution", "T_cn_cnm1"}) {
    const std::string camera = key == "T_cn_cnm1" ? "cam1" : "cam0";
    EXPECT_THAT(
        errorOfText(replaced(kCam0 + kCam1, key, "no_" + key)),
        AllOf(StartsWith(file().string() + ":"), HasSubstr(camera + ": " + key + " is missing")));
  }
  EXPECT_NO_THROW(read(replaced(kCam0, "-0.002]", "-0.002, 0.1]")));
  const Rig limits = read(replaced(kCam0, "[240, 180]", "[65535, 1]"));
  EXPECT_EQ(limits.cameras[0].model.width, 65'535);
  EXPECT_EQ(limits.cameras[0].model.height, 1);
}

}  // namespace
}  // namespace efm
