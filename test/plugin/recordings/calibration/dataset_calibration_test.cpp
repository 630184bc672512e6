// SPDX-License-Identifier: BSD-3-Clause
// The calibration files of real data sets, and those of config/ for them.

#include <gtest/gtest.h>

#include <filesystem>
#include <iterator>
#include <utility>

#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/recordings/calibration/calibration_formats.h"
#include "test/paths.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

const fs::path kFiles = EFM_SHARED_DATA "/calibration";
const fs::path kConfig = EFM_SOURCE_DIR "/config/calibration";
const fs::path kDsec = kFiles / "dsec/zurich_city_04_a_calibration";

class DatasetCalibration : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kFiles)) GTEST_SKIP() << kFiles << " is not there";
  }
};

void expectNear(const Rigid3& T_a_b, const Rigid3& expected, double tolerance) {
  const Rigid3 difference = T_a_b.inverse() * expected;
  EXPECT_LT(difference.translation.norm(), tolerance);
  EXPECT_LT(difference.rotation.vec().norm(), tolerance);
}

TEST_F(DatasetCalibration, OfConfigIsThatOfTheDataSet) {
  const std::pair<const char*, const char*> pairs[] = {
      {"mvsec.yaml", "mvsec/calib_in_flying/camchain-imucam-indoor_flying.yaml"},
      {"dsec.yaml", "dsec/camchain.yaml"},
      {"tumvie_a.yaml", "tum-vie/camchainA.yaml"},
      {"tumvie_b.yaml", "tum-vie/camchainB.yaml"}};
  const auto files = std::distance(fs::directory_iterator(kConfig), fs::directory_iterator());
  EXPECT_EQ(files, std::distance(std::begin(pairs), std::end(pairs)));
  for (const auto& [ours, original] : pairs) {
    const Rig rig = readCamchain(kConfig / ours);
    const Rig expected = readCamchain(kFiles / original);
    ASSERT_EQ(rig.cameras.size(), 2U) << ours;
    for (std::size_t c = 0; c < 2; ++c) {
      EXPECT_EQ(rig.cameras[c].model, expected.cameras.at(c).model) << ours << c;
      EXPECT_TRUE(isSame(rig.cameras[c].T_rig_cam, expected.cameras[c].T_rig_cam)) << ours << c;
    }
  }
}

TEST_F(DatasetCalibration, EqualsTheCameraChainBesideIt) {
  const struct {
    fs::path original;
    fs::path camchain;
    double baseline_m;
  } rows[] = {
      {kDsec / "cam_to_cam.yaml", kFiles / "dsec/camchain.yaml", 0.5990},
      {kFiles / "tum-vie/camera-calibrationA.json", kFiles / "tum-vie/camchainA.yaml", 0.1185},
      {kFiles / "tum-vie/camera-calibrationB.json", kFiles / "tum-vie/camchainB.yaml", 0.1188},
      {kFiles / "mvsec/calib_in_flying/camchain-imucam-indoor_flying.yaml",
       kFiles / "mvsec/camchain.yaml", 0.0999},
  };
  for (const auto& row : rows) {
    const Rig rig = readCalibration(row.original).rig;
    const Rig expected = readCamchain(row.camchain);
    ASSERT_EQ(rig.cameras.size(), 2U) << row.original;
    for (std::size_t c = 0; c < 2; ++c) {
      EXPECT_EQ(rig.cameras[c].model, expected.cameras[c].model) << row.original << c;
      expectNear(rig.cameras[c].T_rig_cam, expected.cameras[c].T_rig_cam, 1e-8);
    }
    EXPECT_NEAR(rig.cameras[1].T_rig_cam.translation.norm(), row.baseline_m, 1e-4) << row.original;
  }
}

TEST_F(DatasetCalibration, DsecsHandEyeTransformTurnsLidarPosesIntoPosesOfTheLeftEventCamera) {
  const Calibration calibration = readCalibration(kDsec / "cam_to_cam.yaml");
  const Rigid3 T_lidar_rig = readHandEye(kDsec / "cam_to_lidar.yaml", &calibration);
  // The 101st message of the LiDAR's odometry, and the same pose of the left event camera as the
  // paper's authors have it.
  const Rigid3 T_world_lidar = {Eigen::Quaterniond(0.9166968464851379, -0.021439503878355026,
                                                   0.016320353373885155, -0.39867401123046875)
                                    .normalized(),
                                {17.737157821655273, -38.65839385986328, -1.0624276399612427}};
  const Rigid3 T_world_cam0 = {
      Eigen::Quaterniond(0.246629, -0.266376, 0.662237, -0.655485).normalized(),
      {18.240932, -38.778219, -1.297551}};
  expectNear(T_world_lidar * T_lidar_rig, T_world_cam0, 5e-6);  // the files have six decimals
}

TEST_F(DatasetCalibration, TumViesHandEyeTransformIsThatOfTheMarkerAndTheImu) {
  const Calibration calibration = readCalibration(kFiles / "tum-vie/camera-calibrationA.json");
  ASSERT_TRUE(calibration.T_imu_rig);
  EXPECT_EQ(calibration.T_imu_rig->translation,
            Eigen::Vector3d(-0.034803406191293906, 0.05971773350374604, -0.03694727254557562));
  const Rigid3 T_marker_rig =
      readHandEye(kFiles / "tum-vie/mocap-imu-calibrationA.json", &calibration);
  const Rigid3 T_imu_marker = {Eigen::Quaterniond(0.4621412967462215, 0.4825868335932214,
                                                  0.3181655742164699, 0.6725370155372069)
                                   .normalized(),
                               {0.0682395566125301, 0.05484102693333699, 0.06451606289598333}};
  expectNear(T_imu_marker * T_marker_rig, *calibration.T_imu_rig, 1e-12);
}

}  // namespace
}  // namespace efm
