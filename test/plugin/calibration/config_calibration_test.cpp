// SPDX-License-Identifier: BSD-3-Clause
// The calibrations in config/ against the files of their data sets, number by number.

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "plugin/calibration/camchain.h"
#include "test/paths.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

const fs::path kConfig = EFM_SOURCE_DIR "/config/calibration";
const fs::path kOriginals = EFM_SHARED_DATA "/calibration";

void expectSame(const CameraModel& model, const std::vector<double>& intrinsics,
                const std::vector<double>& coefficients, const std::vector<int>& resolution) {
  EXPECT_EQ((std::vector<double>{model.fx, model.fy, model.cx, model.cy}), intrinsics);
  EXPECT_EQ(model.coefficients, coefficients);
  EXPECT_EQ((std::vector<int>{model.width, model.height}), resolution);
}

Eigen::Matrix4d matrixOf(const Rigid3& T_a_b) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = T_a_b.rotation.toRotationMatrix();
  matrix.topRightCorner<3, 1>() = T_a_b.translation;
  return matrix;
}

/// The files' rotations are such to some 1e-9: the nearest rotation is taken.
void expectNear(const Rigid3& T_rig_cam1, const Eigen::Matrix4d& T_cam1_cam0) {
  const Eigen::Matrix4d difference = matrixOf(T_rig_cam1) - T_cam1_cam0.inverse();
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-8) << difference;
}

TEST(ConfigCalibration, EveryFileIsReadAndHasTwoCameras) {
  int files = 0;
  for (const auto& entry : fs::directory_iterator(kConfig)) {
    EXPECT_EQ(readCamchain(entry.path()).cameras.size(), 2U) << entry.path();
    ++files;
  }
  EXPECT_EQ(files, 4);
}

TEST(ConfigCalibration, EqualsTheCameraChainsOfTheDataSets) {
  const std::vector<std::pair<const char*, const char*>> pairs = {
      {"mvsec.yaml", "mvsec/calib_in_flying/camchain-imucam-indoor_flying.yaml"},
      {"dsec.yaml", "dsec/camchain.yaml"},
      {"tumvie_a.yaml", "tum-vie/camchainA.yaml"},
      {"tumvie_b.yaml", "tum-vie/camchainB.yaml"}};
  for (const auto& [ours, original] : pairs) {
    if (!fs::exists(kOriginals / original)) {
      GTEST_SKIP() << kOriginals / original << " is not there";
    }
    const Rig rig = readCamchain(kConfig / ours);
    const Rig expected = readCamchain(kOriginals / original);
    ASSERT_EQ(rig.cameras.size(), expected.cameras.size()) << ours;
    for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
      EXPECT_EQ(rig.cameras[c].model, expected.cameras[c].model) << ours << " camera " << c;
      EXPECT_EQ(matrixOf(rig.cameras[c].T_rig_cam), matrixOf(expected.cameras[c].T_rig_cam))
          << ours << " camera " << c;
    }
  }
}

TEST(ConfigCalibration, DsecEqualsTheDataSetsEventCameras) {
  const fs::path file = kOriginals / "dsec/zurich_city_04_a_calibration/cam_to_cam.yaml";
  if (!fs::exists(file)) GTEST_SKIP() << file << " is not there";
  const YAML::Node original = YAML::LoadFile(file.string());
  const Rig rig = readCamchain(kConfig / "dsec.yaml");
  const char* const names[] = {"cam0", "cam3"};
  for (std::size_t c = 0; c < 2; ++c) {
    const YAML::Node camera = original["intrinsics"][names[c]];
    EXPECT_EQ(rig.cameras[c].model.distortion, DistortionModel::kRadtan);
    expectSame(rig.cameras[c].model, camera["camera_matrix"].as<std::vector<double>>(),
               camera["distortion_coeffs"].as<std::vector<double>>(),
               camera["resolution"].as<std::vector<int>>());
  }
  Eigen::Matrix4d T_cam3_cam0 = Eigen::Matrix4d::Identity();
  for (const char* name : {"T_10", "T_21", "T_32"}) {
    Eigen::Matrix4d T_next_last;
    for (int row = 0; row < 4; ++row) {
      const auto numbers = original["extrinsics"][name][row].as<std::vector<double>>();
      T_next_last.row(row) = Eigen::RowVector4d::Map(numbers.data());
    }
    T_cam3_cam0 = T_next_last * T_cam3_cam0;
  }
  expectNear(rig.cameras[1].T_rig_cam, T_cam3_cam0);
}

TEST(ConfigCalibration, TumVieEqualsTheDataSetsEventCameras) {
  for (const auto& [ours, original] : {std::pair("tumvie_a.yaml", "camera-calibrationA.json"),
                                       std::pair("tumvie_b.yaml", "camera-calibrationB.json")}) {
    const fs::path file = kOriginals / "tum-vie" / original;
    if (!fs::exists(file)) GTEST_SKIP() << file << " is not there";
    std::ifstream stream(file);
    const nlohmann::json value = nlohmann::json::parse(stream)["value0"];
    const Rig rig = readCamchain(kConfig / ours);
    std::vector<Eigen::Matrix4d> T_imu_cam;
    for (std::size_t c = 0; c < 2; ++c) {
      const nlohmann::json& camera = value["intrinsics"][c + 2];
      EXPECT_EQ(camera["camera_type"], "kb4");
      EXPECT_EQ(rig.cameras[c].model.distortion, DistortionModel::kEquidistant);
      const auto numbers = [&](const std::vector<const char*>& keys) {
        std::vector<double> list;
        for (const char* key : keys) list.push_back(camera["intrinsics"][key].get<double>());
        return list;
      };
      expectSame(rig.cameras[c].model, numbers({"fx", "fy", "cx", "cy"}),
                 numbers({"k1", "k2", "k3", "k4"}),
                 value["resolution"][c + 2].get<std::vector<int>>());
      const nlohmann::json& pose = value["T_imu_cam"][c + 2];
      const Eigen::Quaterniond rotation(pose["qw"].get<double>(), pose["qx"].get<double>(),
                                        pose["qy"].get<double>(), pose["qz"].get<double>());
      const Eigen::Vector3d position(pose["px"].get<double>(), pose["py"].get<double>(),
                                     pose["pz"].get<double>());
      T_imu_cam.push_back(matrixOf({rotation.normalized(), position}));
    }
    expectNear(rig.cameras[1].T_rig_cam, T_imu_cam[1].inverse() * T_imu_cam[0]);
  }
}

}  // namespace
}  // namespace efm
