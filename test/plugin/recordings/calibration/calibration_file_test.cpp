// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/calibration/calibration_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/config/CConfigFile.h>
#include <mrpt/img/TStereoCamera.h>
#include <mrpt/poses/CPose3D.h>
#include <mrpt/poses/CPose3DQuat.h>

#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

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

TEST_F(CalibrationFile, MayBeNineNumbersWhereTheRecordingKnowsTheSize) {
  const Calibration calibration = read("#fx fy\n200 201 120 90 0.1 0 0 0 0\n");
  CameraModel expected{240, 180, 200, 201, 120, 90, DistortionModel::kRadtan, {}};
  expected.coefficients = {0.1, 0, 0, 0, 0};
  EXPECT_EQ(calibration.camera(0, CameraSize{240, 180}).model, expected);
  EXPECT_EQ(readUzhCalibration(folder() / "given.txt", {240, 180}), expected);
  expected.coefficients[0] = 0;
  EXPECT_EQ(read("200 201 120 90 0 0 0 0 0").camera(0, CameraSize{240, 180}).model, expected);
  EXPECT_THAT(messageOf([&] { calibration.camera(0, std::nullopt); }),
              HasSubstr("given.txt: no size of the sensor"));
}

TEST_F(CalibrationFile, MayBeginWithAByteOrderMark) {
  const std::string mark = "\xEF\xBB\xBF";
  EXPECT_EQ(read(mark + "200 201 120 90 0.1 0 0 0 0\n").rig.cameras.at(0).model.fx, 200);
  EXPECT_EQ(read(mark + (kCamchain + 14)).rig.cameras.at(1).model.fx, 300);
  CameraModel expected{640, 480, 300, 301, 320, 240, DistortionModel::kRadtan, {}};
  expected.coefficients = {1, 0, 0, 0, 0};
  EXPECT_EQ(read(mark + "; a\n# b\n// c\n% d\n[CAMERA] ; e\nresolution = [640 480] # f\nfx = 300\n"
                        "fy = 301 // g\ncx = 320\ncy = 240 % h\ndist = [1 0 0 0 0 0 0]")
                .rig.cameras.at(0)
                .model,
            expected);
}

TEST_F(CalibrationFile, AnErrorOfOtherCamerasNamesTheFileAndBothCounts) {
  const Calibration calibration = read(kCamchain);
  Rig recorded = calibration.rig;
  EXPECT_NO_THROW(calibration.requireLike(recorded));
  for (const auto& [width, height] : {std::pair(640, 180), std::pair(240, 480)}) {
    recorded.cameras[1].model.width = width;
    recorded.cameras[1].model.height = height;
    const std::string size = std::to_string(width) + "x" + std::to_string(height);
    EXPECT_THAT(messageOf([&] { calibration.requireLike(recorded); }),
                EndsWith("given.txt: camera 1 has 240x180 pixels: expected " + size +
                         " pixels, as the recording has"));
  }
  recorded.cameras[1].model.width = recorded.cameras[1].model.height = 65'535;  // not known
  EXPECT_NO_THROW(calibration.requireLike(recorded));
  recorded.cameras.pop_back();
  EXPECT_THAT(messageOf([&] { calibration.requireLike(recorded); }),
              EndsWith("given.txt: 2 cameras: expected 1, as the recording has"));
  EXPECT_THAT(messageOf([&] { calibration.camera(2, std::nullopt); }),
              HasSubstr("given.txt: 2 cameras, but the recording has camera 2: expected one"));
}

constexpr const char* kCameraInfo =
    "image_width: 346\nimage_height: 260\ncamera_name: left\n"
    "camera_matrix: {rows: 3, cols: 3, data: [226, 0, 173, 0, 227, 133, 0, 0, 1]}\n"
    "distortion_model: plumb_bob\n"
    "distortion_coefficients: {rows: 1, cols: 5, data: [0.1, 0.2, 0.3, 0.4, 0.5]}\n";

TEST_F(CalibrationFile, MayBeTheCameraInfoOfRos) {
  const Rig rig = read(kCameraInfo).rig;
  ASSERT_EQ(rig.cameras.size(), 1U);
  CameraModel expected{346, 260, 226, 227, 173, 133, DistortionModel::kRadtan, {}};
  expected.coefficients = {0.1, 0.2, 0.3, 0.4, 0.5};
  EXPECT_EQ(rig.cameras[0].model, expected);

  std::string fisheye = replaced(kCameraInfo, "plumb_bob", "equidistant");
  fisheye = replaced(fisheye, ", 0.5]", "]");
  EXPECT_EQ(read(fisheye).rig.cameras[0].model.distortion, DistortionModel::kEquidistant);
  EXPECT_EQ(read(replaced(fisheye, "equidistant", "fisheye")).rig.cameras[0].model,
            read(fisheye).rig.cameras[0].model);
}

TEST_F(CalibrationFile, MayBeAnIniFileOfMrptsCameraCalibration) {
  mrpt::img::TStereoCamera stereo;
  stereo.leftCamera.ncols = 640;
  stereo.leftCamera.nrows = 480;
  stereo.leftCamera.setIntrinsicParamsFromValues(500, 501, 320, 240);
  stereo.leftCamera.setDistortionPlumbBob(0.1, 0.2, 0.3, 0.4, 0.5);
  stereo.rightCamera = stereo.leftCamera;
  stereo.rightCamera.setDistortionKannalaBrandt(0.1, 0.2, 0.3, 0.4);
  stereo.rightCameraPose = {0.1, 0.01, 0.02, 0.8, 0.6, 0, 0};
  {
    mrpt::config::CConfigFile file((folder() / "stereo.ini").string());
    stereo.saveToConfigFile("CAMERA_PARAMS", file);
    mrpt::config::CConfigFile one((folder() / "one.ini").string());
    stereo.leftCamera.saveToConfigFile("ANY_NAME", one);
  }
  const Rig rig = readCalibration(folder() / "stereo.ini").rig;
  ASSERT_EQ(rig.cameras.size(), 2U);
  CameraModel left{640, 480, 500, 501, 320, 240, DistortionModel::kRadtan, {}};
  left.coefficients = {0.1, 0.2, 0.3, 0.4, 0.5};
  EXPECT_EQ(rig.cameras[0].model, left);
  CameraModel right = left;
  right.distortion = DistortionModel::kEquidistant;
  right.coefficients = {0.1, 0.2, 0.3, 0.4};
  EXPECT_EQ(rig.cameras[1].model, right);
  // MRPT's own pose of the right camera carries its point to the left one.
  const Eigen::Vector3d p_rig = rig.cameras[1].T_rig_cam * Eigen::Vector3d(1, 2, 3);
  Eigen::Vector3d expected;
  mrpt::poses::CPose3D(mrpt::poses::CPose3DQuat(stereo.rightCameraPose))
      .composePoint(1, 2, 3, expected.x(), expected.y(), expected.z());
  EXPECT_LT((p_rig - expected).norm(), 1e-5);

  const Rig one = readCalibration(folder() / "one.ini").rig;
  ASSERT_EQ(one.cameras.size(), 1U);
  EXPECT_EQ(one.cameras[0].model, left);
}

/// TUM-VIE's, without the two frame cameras' values.
constexpr const char* kTumVie = R"({"value0": {
"resolution": [[1, 2], [3, 4], [64, 48], [65, 49]],
"intrinsics": [{}, {},
{"camera_type": "kb4", "intrinsics": {"fx": 50, "fy": 51, "cx": 32, "cy": 24,
"k1": 1, "k2": 2, "k3": 3, "k4": 4}},
{"camera_type": "kb5", "intrinsics": {}}],
"T_imu_cam": [{}, {}, {"px": 1, "py": 2, "pz": 3, "qx": 0, "qy": 0, "qz": 1.0011, "qw": 0}]}})";

TEST_F(CalibrationFile, AnErrorNamesTheFileThePlaceAndTheExpectedValue) {
  const std::string ini =
      "; stereo\n[A_LEFT]\nresolution = [64 48]\nfx = 50\nfy = 50\ncx = 32\ncy = 24\n"
      "distortion = none\n";
  const struct {
    std::string text;
    const char* error;
  } cases[] = {
      {"", "given.txt: not a calibration: expected a Kalibr camera chain, DSEC's"},
      {"[1, 2]\n", "given.txt: not a calibration: expected a Kalibr camera chain"},
      {"left: {fx: 3}\n", "given.txt: not a calibration: expected a Kalibr camera chain"},
      {std::string("\x89HDF\r\n\x1a\n\0\0", 10), "given.txt"},
      {"200 200 120 90 0 0 0 0\n", "given.txt: 8 numbers: expected 9, fx fy cx cy k1 k2 p1 p2 k3"},
      {"200 200 120 90 0 0 0 0 0 0\n", "given.txt: 10 numbers: expected 9"},
      {"200 201\n120 \x1b[2J\n", "given.txt:2: '\\x1b[2J': expected a finite number"},
      {"0 201 120 90 0 0 0 0 0\n", "given.txt: fx = 0: must be finite and above 0"},
      {R"({"value0": {"T_imu_marker": {"px": 1}}})", "given.txt:1: value0: resolution is missing"},
      {R"({"value0": {"resolution": [[1, 2]]}})",
       "value0: resolution = a list: expected 4 rows of 2 numbers"},
      {kTumVie, "value0: T_imu_cam[2]: qx qy qz qw of length 1.0011: expected a rotation"},
      {replaced(kTumVie, "1.0011", "1.0009"),
       "value0: intrinsics[3]: camera_type = 'kb5': expected"},
      {replaced(replaced(kTumVie, "1.0011", "1"), "kb5", "kb4"),
       "intrinsics[3]: intrinsics: fx is"},
      {replaced(replaced(kTumVie, "1.0011", "1"),
                ",\n{\"camera_type\": \"kb5\", \"intrinsics\": {}}", ""),
       "value0: intrinsics = a list: expected a list of at least 4 items"},
      {replaced(kTumVie, "[64, 48]", "[64, 65536]"),
       ":2: value0: resolution = 65536: expected whole"},
      {replaced(kTumVie, "\"k4\": 4", "\"k4\": \"a\""), "intrinsics: k4 = 'a': expected a finite"},
      {"intrinsics: {cam0: 3}\nextrinsics: {}\n", "intrinsics: cam0: expected keys and values"},
      {"intrinsics: {}\nextrinsics: {}\n", "intrinsics: cam0 is missing"},
      {replaced(kCameraInfo, "plumb_bob", "rational_polynomial"),
       "given.txt:5: distortion_model = 'rational_polynomial': expected plumb_bob, equidistant"},
      {replaced(kCameraInfo, "133, 0, 0, 1]", "133, 0, 0]"),
       ":4: camera_matrix: data: 8 numbers: expected 9, fx 0 cx"},
      {replaced(kCameraInfo, "260", "260.5"), "image_height = 260.5: expected whole numbers"},
      {replaced(kCameraInfo, ", 0.4, 0.5]", "]"),
       "number of distortion coefficients = 3: must be 4 or 5"},
      {replaced(ini, "fx = 50", "fx = a"), "[A_LEFT]: fx = 'a': expected a finite number"},
      {replaced(ini, "fx = 50", "fx 50"), "given.txt:4: 'fx 50': expected [section] or key"},
      {replaced(ini, "fx = 50\n", ""), "given.txt: 0 sections with fx: expected one camera"},
      {replaced(ini, "cx = 32\n", ""), "[A_LEFT]: cx is missing"},
      {replaced(ini, "[64 48]", "[]"), "[A_LEFT]: resolution: 0 numbers: expected 2, width height"},
      {replaced(ini, "none", "fov"), "[A_LEFT]: distortion = 'fov': expected none, plumb_bob"},
      {ini + replaced(ini, "A_LEFT", "B_RIGHT"), "2 sections with fx: expected one camera, or"},
      {ini + replaced(ini, "A_LEFT", "A_RIGHT"), "given.txt: [A_LEFT2RIGHT_POSE] is missing"},
      {ini + replaced(ini, "A_LEFT", "A_RIGHT") +
           "[A_LEFT2RIGHT_POSE]\npose_quaternion = [1 0 0 0 0 1.0011 0]\n",
       "[A_LEFT2RIGHT_POSE]: pose_quaternion = a quaternion of length 1.0011: expected a rotation"},
      {replaced(ini, "none", "plumb_bob\ndist = [1 0 0 0 0 0 0 2]"),
       "number of distortion coefficients = 8: must be 4 or 5"},
  };
  for (const auto& row : cases) EXPECT_THAT(errorOfText(row.text), HasSubstr(row.error));
  for (const char* matrix :
       {"226, 1, 173, 0, 227, 133, 0, 0, 1", "226, 0, 173, 1, 227, 133, 0, 0, 1",
        "226, 0, 173, 0, 227, 133, 1, 0, 1", "226, 0, 173, 0, 227, 133, 0, 1, 1",
        "226, 0, 173, 0, 227, 133, 0, 0, 2"}) {
    EXPECT_THAT(errorOfText(replaced(kCameraInfo, "226, 0, 173, 0, 227, 133, 0, 0, 1", matrix)),
                HasSubstr(":4: camera_matrix: data = a matrix with skew"));
  }
  EXPECT_EQ(read(ini).rig.cameras[0].model.distortion, DistortionModel::kNone);
  const std::string numbers = "200 201 120 90 0.1 0 0 0 0\n";
  EXPECT_NO_THROW(read(numbers + std::string(10'000'000 - numbers.size(), ' ')));
  EXPECT_THAT(errorOfText(numbers + std::string(10'000'001 - numbers.size(), ' ')),
              HasSubstr("given.txt: larger than 10 MB"));
  EXPECT_THAT(errorOf([&] { readCalibration(folder() / "nowhere"); }),
              EndsWith("nowhere: cannot be opened for reading"));
  EXPECT_THAT(errorOf([&] { readCalibration(folder()); }),
              EndsWith("cannot be opened for reading"));
}

}  // namespace
}  // namespace efm
