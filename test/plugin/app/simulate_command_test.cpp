// SPDX-License-Identifier: BSD-3-Clause
// `event-fusion simulate` on a trajectory with a calibration, as a user runs it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <string>

#include "mapping/geometry/rig.h"
#include "plugin/recordings/calibration/calibration_formats.h"
#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

using testing::HasSubstr;

class SimulateCommand : public AppTest {
 protected:
  void simulate(const std::string& arguments) const {
    const Result result = run("simulate " + arguments);
    EXPECT_EQ(result.status, 0) << arguments << "\n" << result.err;
  }

  /// Three small cameras in three orientations, and a second of walking ahead.
  void writeRigAndTrajectory() const {
    std::ofstream chain(folder() / "rig.yaml");
    const char* const models[] = {
        "radtan\n  distortion_coeffs: [-0.3, 0.1, 0.001, -0.002]",
        "equidistant\n  distortion_coeffs: [-0.05, 0.01, -0.02, 0.005]\n"
        "  T_cn_cnm1: [[0, -1, 0, 0.1], [1, 0, 0, 0.02], [0, 0, 1, 0], [0, 0, 0, 1]]",
        "none\n  distortion_coeffs: []\n"
        "  T_cn_cnm1: [[0.96, 0, 0.28, -0.1], [0, 1, 0, 0], [-0.28, 0, 0.96, 0.01], [0, 0, 0, 1]]"};
    for (int i = 0; i < 3; ++i) {
      chain << "cam" << i << ":\n  camera_model: pinhole\n  intrinsics: [50, 51, 31.5, 23]\n"
            << "  resolution: [" << 64 - i << ", " << 48 + i
            << "]\n  distortion_model: " << models[i] << "\n";
    }
    std::ofstream poses(folder() / "walk.txt");
    for (int i = 0; i <= 100; ++i) poses << i * 0.01 << " 0 0 " << i * 0.008 << " 0 0 0 1\n";
  }
};

TEST_F(SimulateCommand, WritesTheGivenRig) {
  writeRigAndTrajectory();
  simulate(
      "--scene room --trajectory walk.txt --calibration rig.yaml --start 0.2 --duration 0.1 "
      "--noise-hz 20 --mismatch 0.05 --refractory-us 2000 --out sim");
  const Rig given = readCamchain(folder() / "rig.yaml");
  const Rig written = readCamchain(folder() / "sim/camchain.yaml");
  ASSERT_EQ(written.cameras.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(written.cameras[i].model, given.cameras[i].model);
    const Rigid3& T_rig_cam = given.cameras[i].T_rig_cam;
    EXPECT_LT((written.cameras[i].T_rig_cam.translation - T_rig_cam.translation).norm(), 1e-12);
    EXPECT_LT(written.cameras[i].T_rig_cam.rotation.angularDistance(T_rig_cam.rotation), 1e-7);
    EXPECT_GT(contentOf("sim/cam" + std::to_string(i) + "/events.txt").size(), 0U);
  }
  EXPECT_THAT(contentOf("sim/depth/index.txt"), HasSubstr("0.200000000"));
}

TEST_F(SimulateCommand, NoiseHasItsRate) {
  writeRigAndTrajectory();
  simulate(
      "--scene room --trajectory walk.txt --calibration rig.yaml --duration 0.1 --threshold-on 5 "
      "--threshold-off 5 --hot-hz 500 --hot-pixels 0.1 --out sim");
  const std::string events = contentOf("sim/cam0/events.txt");
  const auto lines = static_cast<double>(std::count(events.begin(), events.end(), '\n'));
  const double expected = 64 * 48 * 0.1 * 500 * 0.1;
  // Hot pixels are drawn (their number's deviation is 17 of 307), and each fires 50 times.
  EXPECT_NEAR(lines, expected, 0.25 * expected);
}

TEST_F(SimulateCommand, SimulatesRealRigsOnRealTrajectories) {
  const std::filesystem::path shared = EFM_SHARED_DATA;
  if (!std::filesystem::exists(shared / "trajectories")) GTEST_SKIP() << shared << " is not there";
  const std::string trajectories = (shared / "trajectories").string();
  const std::string calibrations = (shared / "calibration").string();
  simulate("--scene room --trajectory '" + trajectories +
           "/mvsec_indoor_flying1.txt' --calibration '" + calibrations +
           "/mvsec/camchain.yaml' --duration 0.02 --out mvsec");
  const Rig given = readCamchain(shared / "calibration/mvsec/camchain.yaml");
  const Rig written = readCamchain(folder() / "mvsec/camchain.yaml");
  ASSERT_EQ(written.cameras.size(), 2U);
  EXPECT_EQ(written.cameras[1].model, given.cameras[1].model);
  EXPECT_GT(contentOf("mvsec/cam1/events.txt").size(), 1000U);
}

}  // namespace
}  // namespace efm
