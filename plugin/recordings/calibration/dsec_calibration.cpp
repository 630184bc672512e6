// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/calibration/dsec_calibration.h"

#include "plugin/recordings/calibration/camera_entry.h"

namespace efm {

Calibration readDsecCalibration(const YamlEntry& root, const std::filesystem::path& file) {
  const YamlEntry intrinsics = root.section("intrinsics");
  const YamlEntry extrinsics = root.section("extrinsics");
  Calibration calibration{file, {}};
  for (const char* name : {"cam0", "cam3"}) {
    RigCamera& camera = calibration.rig.cameras.emplace_back();
    camera.model = readKalibrCamera(intrinsics.section(name), "camera_matrix");
  }
  const Rigid3 T_cam1_cam0 = extrinsics.transform("T_10");
  const Rigid3 T_cam3_cam0 =
      extrinsics.transform("T_32") * extrinsics.transform("T_21") * T_cam1_cam0;
  calibration.rig.cameras[1].T_rig_cam = T_cam3_cam0.inverse();
  calibration.T_camRect1_rig =
      Rigid3{extrinsics.rotation("R_rect1"), Eigen::Vector3d::Zero()} * T_cam1_cam0;
  return calibration;
}

Rigid3 readDsecHandEye(const YamlEntry& root, const Calibration* calibration) {
  const Rigid3 T_lidar_camRect1 = root.transform("T_lidar_camRect1");
  if (calibration == nullptr || !calibration->T_camRect1_rig) {
    throw root.fail(
        "T_lidar_camRect1 is of a rectified frame camera: expected the calibration "
        "cam_to_cam.yaml, too");
  }
  return T_lidar_camRect1 * *calibration->T_camRect1_rig;
}

}  // namespace efm
