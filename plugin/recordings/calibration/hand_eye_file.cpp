// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/calibration/hand_eye_file.h"

#include <stdexcept>

#include "plugin/recordings/calibration/camchain.h"
#include "plugin/recordings/calibration/dsec_calibration.h"
#include "plugin/recordings/calibration/tumvie_calibration.h"
#include "plugin/recordings/calibration/yaml_entry.h"

namespace efm {

Rigid3 readHandEye(const std::filesystem::path& file, const Calibration* calibration) {
  constexpr const char* kKey = "T_body_rig";
  const YAML::Node root = loadYaml(file.string());
  if (root.IsMap()) {
    const YamlEntry entry(file.string(), "", root);
    if (entry.has(kKey)) return entry.transform(kKey);
    if (entry.has("T_lidar_camRect1")) return readDsecHandEye(entry, calibration);
    if (entry.has("value0")) return readTumVieHandEye(entry, calibration);
    if (entry.has("cam0")) {
      if (const auto T_imu_rig = readCamchainImu(file)) return *T_imu_rig;
      throw entry.section("cam0").fail("T_cam_imu is missing: expected 4 rows of 4 numbers");
    }
  }
  throw std::runtime_error(
      file.string() +
      ": T_body_rig is missing: expected YAML, T_body_rig: 4 rows of 4 numbers, from the rig's "
      "frame to that of the tracked body; or a Kalibr camera chain with T_cam_imu, DSEC's "
      "cam_to_lidar.yaml, or TUM-VIE's mocap-imu-calibration*.json");
}

}  // namespace efm
