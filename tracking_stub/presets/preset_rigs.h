// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "mapping/geometry/rig.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"
#include "tracking_stub/sensor/simulated_rig.h"

namespace efm {

/// Parts of presets: rigs and motions.

/// The start of every preset.
inline constexpr std::int64_t kPresetStartNs = kNanosecondsPerSecond;

inline double radians(double deg) { return deg * kPi / 180; }

/// R_world_cam of a level camera (x right, y down, z forward) that looks along y in a world whose z
/// is up.
inline Eigen::Quaterniond lookingAlongY() {
  Eigen::Matrix3d R_world_cam;
  R_world_cam << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return Eigen::Quaterniond(R_world_cam);
}

/// No distortion, the principal point in the middle.
inline CameraModel makePinhole(int width, int height, double focal_px) {
  CameraModel model;
  model.width = width;
  model.height = height;
  model.fx = model.fy = focal_px;
  model.cx = 0.5 * width;
  model.cy = 0.5 * height;
  return model;
}

/// Two equal cameras, the second `baseline_m` to the right of the first. The rig's frame is the
/// first.
inline Rig makeStereoRig(const CameraModel& model, double baseline_m) {
  Rig rig;
  rig.cameras.resize(2);
  rig.cameras[0].model = rig.cameras[1].model = model;
  rig.cameras[1].T_rig_cam.translation = {baseline_m, 0, 0};
  return rig;
}

/// A preset without scene, rig and motion.
/// @param threshold contrast threshold of both polarities.
inline Simulation emptyPreset(double duration_s, double threshold, std::uint64_t seed) {
  Simulation simulation;
  simulation.start_ns = kPresetStartNs;
  simulation.duration_ns = durationFromSeconds(duration_s);
  simulation.pixels.threshold_on = simulation.pixels.threshold_off = threshold;
  simulation.seed = seed;
  return simulation;
}

}  // namespace efm
