// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "mapping/base/named_choice.h"
#include "mapping/base/option.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/trajectory.h"
#include "tracking_stub/sensor/simulated_rig.h"

namespace efm {

inline double radians(double deg) { return deg * kPi / 180; }

/// Returns a camera without distortion, with the principal point in the middle.
inline CameraModel makePinhole(int width, int height, double focal_px) {
  CameraModel model;
  model.width = width;
  model.height = height;
  model.fx = model.fy = focal_px;
  model.cx = 0.5 * width;
  model.cy = 0.5 * height;
  return model;
}

/// Returns two equal cameras. The second is `baseline_m` to the right of the first. The rig's frame
/// is the frame of the first camera.
inline Rig makeStereoRig(const CameraModel& model, double baseline_m) {
  Rig rig;
  rig.cameras.resize(2);
  rig.cameras[0].model = rig.cameras[1].model = model;
  rig.cameras[1].T_rig_cam.translation = {baseline_m, 0, 0};
  return rig;
}

/// Returns the function whose name is an option's value.
template <typename Make, std::size_t N>
Make makerIn(const NamedChoice<Make> (&makers)[N], const std::string& option,
             const std::string& name) {
  try {
    return valueIn(makers, name);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(option + ": " + error.what());
  }
}

/// What is simulated: a preset, or a scene around a trajectory. Each preset starts at t = 1 s;
/// README.md has a table of their cameras, durations and depths.
struct SimulationOptions {
  std::string preset = "desk_stereo";  ///< One of `simulationPresets`; unused with a scene.
  /// Duration in seconds, 0.001 to 600. Default: the preset's duration; on a trajectory 5, or less
  /// if it ends earlier.
  std::optional<double> duration_s = std::nullopt;
  /// Seed of all random values: the paintings and the initial memory of the pixels.
  std::uint64_t seed = 1;
  /// None, or one of `simulationScenes`, built around the simulated part of the trajectory:
  ///   room    a furnished room; its walls are at least 1.9 m from the path;
  ///   street  a street along the path, for vehicles: see makeStreet;
  ///   poles   thin poles before a wall, in the mean viewing direction.
  /// The scene's direction down is the mean y axis of the cameras.
  std::string scene = {};
  /// T_world_cam0, in any order. They are smoothed (see `smoothTrajectory`), and the smoothed
  /// trajectory is the truth. With a preset they replace its motion.
  std::vector<StampedPose> poses = {};
  /// The rig's frame is the frame of camera 0. With a preset they replace its cameras.
  std::vector<RigCamera> cameras = {};
  /// Start time in the trajectory's clock. Default: `startOfMotion`.
  std::optional<std::int64_t> start_ns = std::nullopt;
  /// Contrast thresholds of all pixels. Default: the preset's, or those of `EventPixelOptions`.
  std::optional<double> threshold_on = std::nullopt;
  std::optional<double> threshold_off = std::nullopt;
  double mismatch = 0;  ///< See `EventPixelOptions`, also for the next.
  double refractory_us = 0;
  EventNoiseOptions noise = {};
};

std::vector<std::string> simulationPresets();
std::vector<std::string> simulationScenes();

/// Moves the cameras of a simulation along the trajectory of the options, through their scene, or
/// without one through the simulation's own.
void moveAlong(const SimulationOptions& options, Simulation& simulation);

/// Makes scene, rig and motion.
/// @throws std::invalid_argument if an option is out of range.
Simulation makeSimulation(const SimulationOptions& options = {});

}  // namespace efm
