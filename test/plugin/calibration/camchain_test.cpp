// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/calibration/camchain.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ostream>
#include <string>

#include "test/paths.h"
#include "test/plugin/formats/files.h"
#include "test/plugin/temporary_folder.h"
#include "tracking_stub/truth/dataset_writer.h"

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

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

class Camchain : public TemporaryFolder {
 protected:
  std::filesystem::path file() const { return folder() / "camchain.yaml"; }
  Rig read(const std::string& text) const {
    writeFile(file(), text);
    return readCamchain(file());
  }
  std::string errorOfText(const std::string& text) const {
    return errorOf([&] { read(text); });
  }
  std::string errorWith(const std::string& from, const std::string& to) const {
    return errorOfText(replaced(kCam0 + kCam1, from, to));
  }
};

TEST_F(Camchain, HasEachCamerasModel) {
  const Rig rig = read(kCam0 + kCam1);
  ASSERT_EQ(rig.cameras.size(), 2U);
  CameraModel expected;
  expected.width = 240;
  expected.height = 180;
  expected.fx = 200;
  expected.fy = 201;
  expected.cx = 120;
  expected.cy = 90;
  expected.distortion = DistortionModel::kRadtan;
  expected.coefficients = {-0.1, 0.02, 0.001, -0.002};
  EXPECT_TRUE(rig.cameras[0].model == expected);
  EXPECT_EQ(rig.cameras[1].model.width, 320);
  EXPECT_EQ(rig.cameras[1].model.distortion, DistortionModel::kNone);
}

TEST_F(Camchain, TheRigsFrameIsThatOfCameraZero) {
  const Rig rig = read(kCam0 + kCam1);
  EXPECT_TRUE(rig.cameras[0].T_rig_cam.rotation.isApprox(Eigen::Quaterniond::Identity()));
  EXPECT_TRUE(rig.cameras[0].T_rig_cam.translation.isZero());
  // T_cn_cnm1 carries camera 0's point (1, 2, 3) to (-2, 1, 3) + (0.1, 0.2, 0.3) in camera 1.
  const Eigen::Vector3d p_rig = rig.cameras[1].T_rig_cam * Eigen::Vector3d(-1.9, 1.2, 3.3);
  EXPECT_LT((p_rig - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12) << p_rig.transpose();
}

TEST_F(Camchain, EachTransformStartsAtTheCameraBefore) {
  const Rig rig = read(kCam0 + kCam1 + replaced(kCam1, "cam1", "cam2"));
  ASSERT_EQ(rig.cameras.size(), 3U);
  const Rigid3 T_cam1_rig = rig.cameras[1].T_rig_cam.inverse();
  const Rigid3 T_cam2_rig = rig.cameras[2].T_rig_cam.inverse();
  const Eigen::Vector3d p_rig(1, 2, 3);
  EXPECT_LT((T_cam2_rig * p_rig - T_cam1_rig * (T_cam1_rig * p_rig)).norm(), 1e-12);
}

TEST_F(Camchain, WhatTheDatasetWriterWritesIsReadBack) {
  const Rig rig = read(kCam0 + kCam1 + replaced(kCam1, "cam1", "cam2"));
  const Rig again = read(formatCamchain(rig));
  ASSERT_EQ(again.cameras.size(), rig.cameras.size());
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    EXPECT_TRUE(again.cameras[i].model == rig.cameras[i].model) << i;
    const Rigid3 T_again_rig = again.cameras[i].T_rig_cam.inverse() * rig.cameras[i].T_rig_cam;
    EXPECT_LT(T_again_rig.translation.norm(), 1e-14) << i;
    EXPECT_LT(T_again_rig.rotation.vec().norm(), 1e-14) << i;
  }
}

TEST_F(Camchain, DistortionNoneNeedsNoCoefficients) {
  const Rig rig = read(replaced(kCam0 + kCam1, "  distortion_coeffs: []\n", ""));
  EXPECT_TRUE(rig.cameras[1].model.coefficients.empty());
}

TEST_F(Camchain, ARoundedRotationIsTakenAndMadeExact) {
  const Rig rig = read(replaced(kCam0 + kCam1, "- [0, -1, 0, 0.1]", "- [0.0004, -0.9997, 0, 0.1]"));
  EXPECT_NEAR(rig.cameras[1].T_rig_cam.rotation.norm(), 1, 1e-15);
}

TEST_F(Camchain, AMissingFileIsNamed) {
  EXPECT_THAT(errorOf([&] { readCamchain(file()); }),
              AllOf(StartsWith(file().string()), HasSubstr("cannot be opened")));
}

TEST_F(Camchain, WhatIsNoYamlIsAnErrorThatNamesTheLine) {
  EXPECT_THAT(errorOfText("cam0:\n  intrinsics: [1, 2\n"),
              AllOf(StartsWith(file().string() + ":"), HasSubstr("not YAML")));
}

TEST_F(Camchain, WithoutCameraZeroIsAnError) {
  for (const char* text : {"", "42", "[1, 2]", "left:\n  intrinsics: 3\n"}) {
    EXPECT_THAT(errorOfText(text), AllOf(StartsWith(file().string()), HasSubstr("cam0 is missing")))
        << text;
  }
}

TEST_F(Camchain, AGapInTheNumbersIsAnError) {
  EXPECT_THAT(errorOfText(kCam0 + replaced(kCam1, "cam1", "cam2")),
              AllOf(StartsWith(file().string()), HasSubstr("cam2 without cam1")));
}

TEST_F(Camchain, AMissingKeyIsAnErrorThatNamesTheCamera) {
  const std::string cam1 = replaced(replaced(kCam1, "model: none", "model: radtan"),
                                    "distortion_coeffs: []", "distortion_coeffs: [0, 0, 0, 0]");
  for (const char* key : {"camera_model", "intrinsics", "distortion_model", "distortion_coeffs",
                          "resolution", "T_cn_cnm1"}) {
    const std::string text = kCam0 + replaced(cam1, key, std::string("no_") + key);
    EXPECT_THAT(errorOfText(text), AllOf(StartsWith(file().string() + ":"), HasSubstr("cam1: "),
                                         HasSubstr(key), HasSubstr(" is missing")));
  }
}

TEST_F(Camchain, AWrongTypeIsAnErrorThatNamesFileLineCameraAndKey) {
  EXPECT_THAT(
      errorWith("[200, 201, 120, 90]", "[200, abc, 120, 90]"),
      StartsWith(file().string() + ":3: cam0: intrinsics = 'abc': expected finite numbers"));
  EXPECT_THAT(errorWith("[200, 201, 120, 90]", "[200, .nan, 120, 90]"),
              HasSubstr("cam0: intrinsics = '.nan': expected finite numbers"));
  EXPECT_THAT(errorWith("[200, 201, 120, 90]", "200"), HasSubstr("cam0: intrinsics = '200'"));
  EXPECT_THAT(errorWith("[200, 201, 120, 90]", "[200, 201, 120]"),
              HasSubstr("cam0: intrinsics: 3 numbers: expected 4, fx fy cx cy"));
  EXPECT_THAT(errorWith("[320, 240]", "[320]"),
              HasSubstr("cam1: resolution: 1 numbers: expected 2, width height"));
  EXPECT_THAT(errorWith("pinhole", "[pinhole]"), HasSubstr("cam0: camera_model"));
  EXPECT_THAT(errorWith("pinhole", ""), HasSubstr("cam0: camera_model"));
  EXPECT_THAT(errorOfText("cam0: 5\n"), HasSubstr("cam0: expected keys"));
}

TEST_F(Camchain, ValuesOutOfRangeAreErrors) {
  EXPECT_THAT(errorWith("pinhole", "omni"),
              HasSubstr("cam0: camera_model = 'omni': expected pinhole"));
  EXPECT_THAT(errorWith("radtan", "fov"),
              HasSubstr("cam0: distortion_model = 'fov': expected radtan, equidistant or none"));
  EXPECT_THAT(errorWith("[200, 201, 120, 90]", "[-200, 201, 120, 90]"),
              AllOf(HasSubstr("cam0: fx = -200"), HasSubstr("above 0")));
  EXPECT_THAT(errorWith("[320, 240]", "[320, 240.5]"), HasSubstr("cam1: resolution = 240.5"));
  EXPECT_THAT(errorWith("[320, 240]", "[0, 240]"),
              AllOf(HasSubstr("cam1: resolution = 0"), HasSubstr("1 to 65535")));
}

TEST_F(Camchain, AWrongNumberOfCoefficientsIsAnErrorThatSaysHowMany) {
  EXPECT_THAT(
      errorWith("[-0.1, 0.02, 0.001, -0.002]", "[-0.1, 0.02, 0.001]"),
      AllOf(StartsWith(file().string()), HasSubstr("cam0"), HasSubstr("= 3"), HasSubstr("4 or 5")));
  EXPECT_NO_THROW(read(replaced(kCam0, "-0.002]", "-0.002, 0.1]")));
  EXPECT_THAT(errorWith("distortion_coeffs: []", "distortion_coeffs: [0, 0, 0, 0]"),
              AllOf(HasSubstr("cam1"), HasSubstr("= 4"), HasSubstr("must be 0")));
}

TEST_F(Camchain, ATransformThatIsNotRigidIsAnError) {
  EXPECT_THAT(errorWith("- [0, -1, 0, 0.1]", "- [0, -1.01, 0, 0.1]"),
              AllOf(HasSubstr("cam1: T_cn_cnm1"), HasSubstr("0.0201"), HasSubstr("rotation")));
  EXPECT_THAT(errorWith("- [0, -1, 0, 0.1]", "- [0, 1, 0, 0.1]"), HasSubstr("a reflection"));
  EXPECT_THAT(errorWith("- [0, 0, 0, 1]", "- [0, 0, 0.5, 1]"), HasSubstr("0 0 0 1"));
  EXPECT_THAT(errorWith("- [0, 0, 0, 1]\n", ""), HasSubstr("expected 4 rows of 4 numbers"));
  EXPECT_THAT(errorWith("- [0, 0, 1, 0.3]", "- [0, 0, 1]"),
              HasSubstr("T_cn_cnm1: 3 numbers: expected 4 rows of 4 numbers"));
}

struct RealRig {
  const char* file;
  int width, height;
  DistortionModel distortion;
  double baseline_m;
};

std::ostream& operator<<(std::ostream& stream, const RealRig& rig) { return stream << rig.file; }

class RealCamchain : public testing::TestWithParam<RealRig> {};

TEST_P(RealCamchain, HasTwoCamerasSideBySide) {
  const std::filesystem::path file = std::string(EFM_SHARED_DATA "/calibration/") + GetParam().file;
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there";
  const Rig rig = readCamchain(file);
  ASSERT_EQ(rig.cameras.size(), 2U);
  for (const RigCamera& camera : rig.cameras) {
    EXPECT_EQ(camera.model.width, GetParam().width);
    EXPECT_EQ(camera.model.height, GetParam().height);
    EXPECT_EQ(camera.model.distortion, GetParam().distortion);
    EXPECT_EQ(camera.model.coefficients.size(), 4U);
  }
  // The second camera is to the right of the first.
  EXPECT_NEAR(rig.cameras[1].T_rig_cam.translation.x(), GetParam().baseline_m, 1e-3);
  EXPECT_LT(rig.cameras[1].T_rig_cam.rotation.vec().norm(), 0.02);
}

INSTANTIATE_TEST_SUITE_P(
    Rigs, RealCamchain,
    testing::Values(
        RealRig{"mvsec/camchain.yaml", 346, 260, DistortionModel::kEquidistant, 0.0999},
        RealRig{"dsec/camchain.yaml", 640, 480, DistortionModel::kRadtan, 0.5989},
        RealRig{"tum-vie/camchainA.yaml", 1280, 720, DistortionModel::kEquidistant, 0.1184},
        RealRig{"tum-vie/camchainB.yaml", 1280, 720, DistortionModel::kEquidistant, 0.1188}));

}  // namespace
}  // namespace efm
