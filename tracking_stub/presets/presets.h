// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

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

/// The presets: simulations that are ready to run. Each starts at t = 1 s. README.md has a table of
/// their cameras, durations and depths.

/// A hand-held stereo pair looks over a cluttered desk into a room. World: x right, y into the
/// room, z up, the desk's top at z = 0. About a million events per camera.
Simulation makeDeskStereo(std::uint64_t seed);

/// A stereo pair on a car's roof, 1.9 m above the road, drives down a street at 8 m/s. World: y
/// along the street, z up, the road at z = 0. Some pixels see the sky.
Simulation makeDriveStereo(std::uint64_t seed);

/// A stereo pair of high resolution in a furnished room. World: z up. About 2.8 million events per
/// camera.
Simulation makeHdStereo(std::uint64_t seed);

/// The cameras of desk_stereo before thin poles, 3 to 6 pixels wide, and a wall behind them. World:
/// y forward, z up, the origin at the cameras.
Simulation makePolesStereo(std::uint64_t seed);

/// The cameras of desk_stereo go once around in a furnished room and look outwards; the last pose
/// is the first pose. World: origin in the middle of the floor, z up.
Simulation makeRoomStereo(std::uint64_t seed);

/// One camera on a linear slider passes boards and boxes, like `slider_depth` of the Event Camera
/// Dataset (Mueggler et al., IJRR 2017). It does not rotate, so edges along the motion fire no
/// events and have no depth. World: the camera's frame in the middle of the path.
Simulation makeSlider(std::uint64_t seed);

/// Three cameras, each with its own calibration, look into a corner of a furnished room. Camera 1
/// is 0.16 m to the right and looks slightly inwards. Camera 2 is 0.14 m above the middle of the
/// other two, tilted down, and rotated by 90 degrees about its axis. All see the middle of camera
/// 0's view. World: z up.
Simulation makeTrinocular(std::uint64_t seed);

struct SimulationOptions {
  std::string preset = "desk_stereo";  ///< One of `simulationPresets`.
  /// Seconds, 0.001 to 600. Default: the preset's duration.
  std::optional<double> duration_s;
  /// Seed of everything random: the paintings and the initial memory of the pixels.
  std::uint64_t seed = 1;

  void validate() const;
};

std::vector<std::string> simulationPresets();

/// Scene, rig and motion of a preset.
Simulation makeSimulation(const SimulationOptions& options = {});

}  // namespace efm
