// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>
#include <string>

#include "mapping/geometry/timestamp.h"
#include "plugin/checks/health_checks.h"

namespace efm {
namespace {

/// Returns the transforms of a Kalibr camera chain that change if a camera's pose does.
std::string chainText(const Rig& rig, const CameraComparison& found) {
  std::vector<Rigid3> T_rig_cam;
  for (const RigCamera& camera : rig.cameras) T_rig_cam.push_back(camera.T_rig_cam);
  const auto changed = static_cast<std::size_t>(found.camera);
  T_rig_cam[changed] = T_rig_cam[changed] * Rigid3{found.R_cam_fitted, Eigen::Vector3d::Zero()};
  std::string text;
  for (std::size_t c = std::max<std::size_t>(changed, 1); c < T_rig_cam.size() && c <= changed + 1;
       ++c) {
    const Rigid3 T_cn_cnm1 = T_rig_cam[c].inverse() * T_rig_cam[c - 1];
    const Eigen::Matrix3d R = T_cn_cnm1.rotation.toRotationMatrix();
    text += fmt::format("{}cam{} [", text.empty() ? "" : " and ", c);
    for (int row = 0; row < 3; ++row) {
      text += fmt::format("[{:.6f}, {:.6f}, {:.6f}, {:.6f}], ", R(row, 0), R(row, 1), R(row, 2),
                          T_cn_cnm1.translation[row]);
    }
    text += "[0, 0, 0, 1]]";
  }
  return text;
}

std::string axisText(CameraFault fault) {
  switch (fault) {
    case CameraFault::kAcross:
      return "about the baseline, which moves points across the epipolar lines: rays miss each "
             "other, and many of the points are lost or wrong";
    case CameraFault::kAlong:
      return "about the axis across baseline and view, which moves points along the epipolar lines";
    default:
      return "about the optical axis: points are lost or wrong far from the middle of the image";
  }
}

}  // namespace

std::optional<Warning> cameraWarning(const CameraComparison& found, const Rig& rig) {
  const auto& camera = rig.cameras[static_cast<std::size_t>(found.camera)];
  const std::string beside =
      fmt::format("the map of camera {} alone lies {:.2g} pixels beside that of camera {} alone",
                  found.camera, found.shift_px, found.other);
  switch (found.fault) {
    case CameraFault::kNone:
    case CameraFault::kUnknown:
      return std::nullopt;
    case CameraFault::kClock:
      return Warning{
          "camera-clocks",
          fmt::format("{}, as if its clock were {:.1f} ms {}; --set "
                      "rig.time_offsets_s={} fixes it",
                      beside, 1e3 * std::abs(found.clock_s), found.clock_s < 0 ? "late" : "early",
                      offsetsText(rig, static_cast<std::size_t>(found.camera), found.clock_s))};
    case CameraFault::kFocalLength:
      return Warning{
          "extrinsics",
          fmt::format("{}, as if its focal length were {:.2f} % {}; is the calibration of this "
                      "lens? With fx fy = {:.6g} {:.6g} the maps fit (--calibration)",
                      beside, 100 * std::abs(found.zoom - 1), found.zoom > 1 ? "longer" : "shorter",
                      found.zoom * camera.model.fx, found.zoom * camera.model.fy)};
    default:
      break;
  }
  std::string cost;
  if (found.fault == CameraFault::kAlong) {
    cost = fmt::format("; the depths of the map change by {:.0f} % at their median",
                       100 * found.depth_change);
  }
  return Warning{
      "extrinsics",
      fmt::format("{}, as if it were turned by {:.2f} degrees {}{}; extrinsics, principal point or "
                  "lens of camera {} may be wrong, which look alike here: calibrate the cameras "
                  "again, or give T_cn_cnm1 of {} "
                  "(--calibration), with which the maps fit",
                  beside, found.angle_rad / kRadiansPerDegree, axisText(found.fault), cost,
                  found.camera, chainText(rig, found))};
}

}  // namespace efm
