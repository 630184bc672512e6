// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/calibration/tumvie_calibration.h"

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "mapping/base/text.h"
#include "plugin/recordings/calibration/camera_entry.h"

namespace efm {
namespace {

constexpr Eigen::Index kTumVieCameras = 4;
constexpr std::size_t kTumVieEventCameras[] = {2, 3};

Rigid3 jsonPose(const YamlEntry& pose) {
  const Eigen::Quaterniond rotation(pose.number("qw"), pose.number("qx"), pose.number("qy"),
                                    pose.number("qz"));
  const double norm = rotation.norm();
  if (!(std::abs(norm - 1) <= 1e-3)) {
    throw pose.fail(
        fmt::format("qx qy qz qw of length {:g}: expected a rotation, of length 1 to 0.001", norm));
  }
  return {rotation.normalized(), {pose.number("px"), pose.number("py"), pose.number("pz")}};
}

CameraModel kb4Camera(const YamlEntry& value, std::size_t index, const Eigen::MatrixXd& sizes) {
  const YamlEntry camera = value.item("intrinsics", index);
  const std::string type = camera.text("camera_type");
  if (type != "kb4") throw camera.failKey("camera_type", inQuotes(type), "kb4");
  const YamlEntry numbers = camera.section("intrinsics");
  CameraModel model;
  model.fx = numbers.number("fx");
  model.fy = numbers.number("fy");
  model.cx = numbers.number("cx");
  model.cy = numbers.number("cy");
  model.distortion = DistortionModel::kEquidistant;
  for (const char* key : {"k1", "k2", "k3", "k4"}) {
    model.coefficients.push_back(numbers.number(key));
  }
  const auto row = static_cast<Eigen::Index>(index);
  setSensorSize(value, "resolution", sizes(row, 0), sizes(row, 1), model);
  requireValid(numbers, model);
  return model;
}

}  // namespace

Calibration readTumVieCalibration(const YamlEntry& root, const std::filesystem::path& file) {
  const YamlEntry value = root.section("value0");
  const Eigen::MatrixXd sizes = value.matrix("resolution", kTumVieCameras, 2);
  Calibration calibration{file, {}};
  for (const std::size_t index : kTumVieEventCameras) {
    RigCamera& camera = calibration.rig.cameras.emplace_back();
    camera.model = kb4Camera(value, index, sizes);
    const Rigid3 T_imu_cam = jsonPose(value.item("T_imu_cam", index));
    if (!calibration.T_imu_rig) {
      calibration.T_imu_rig = T_imu_cam;
    } else {
      camera.T_rig_cam = calibration.T_imu_rig->inverse() * T_imu_cam;
    }
  }
  return calibration;
}

Rigid3 readTumVieHandEye(const YamlEntry& root, const Calibration* calibration) {
  const YamlEntry value = root.section("value0");
  const Rigid3 T_imu_marker = jsonPose(value.section("T_imu_marker"));
  if (calibration == nullptr || !calibration->T_imu_rig) {
    throw value.fail(
        "T_imu_marker is of the IMU: expected a calibration with the IMU, "
        "camera-calibration*.json, too");
  }
  return T_imu_marker.inverse() * *calibration->T_imu_rig;
}

}  // namespace efm
