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

/// Returns the function whose name is an option's value. Also checks the duration.
template <typename Make, std::size_t N>
Make makerIn(const NamedChoice<Make> (&makers)[N], const std::string& option,
             const std::string& name, const std::optional<double>& duration_s) {
  const Make maker = [&] {
    try {
      return valueIn(makers, name);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(option + ": " + error.what());
    }
  }();
  if (duration_s) {
    requireOption(*duration_s >= 0.001 && *duration_s <= 600, "duration_s", *duration_s,
                  "0.001 to 600");
  }
  return maker;
}

/// The presets: simulations that are ready to run. Each preset starts at t = 1 s. README.md has a
/// table of their cameras, durations and depths.

struct SimulationOptions {
  std::string preset = "desk_stereo";  ///< One of `simulationPresets`.
  /// Duration in seconds, 0.001 to 600. Default: the preset's duration.
  std::optional<double> duration_s = std::nullopt;
  /// Seed of all random values: the paintings and the initial memory of the pixels.
  std::uint64_t seed = 1;
};

std::vector<std::string> simulationPresets();

/// Makes scene, rig and motion of a preset.
Simulation makeSimulation(const SimulationOptions& options = {});

struct TrajectorySimulationOptions {
  /// One of `simulationScenes`:
  ///   room    a furnished room; its walls are at least 1.9 m from the path;
  ///   street  a street along the path, for vehicles: see makeStreet;
  ///   poles   thin poles before a wall, in the mean viewing direction.
  std::string scene = "room";
  /// Start time in the trajectory's clock. Default: `startOfMotion`.
  std::optional<std::int64_t> start_ns;
  /// Duration in seconds, 0.001 to 600. Default: 5, or less if the trajectory ends earlier.
  std::optional<double> duration_s = std::nullopt;
  std::uint64_t seed = 1;
};

/// Returns the names of the scenes that can be built around a trajectory.
std::vector<std::string> simulationScenes();

/// Moves a rig along a measured trajectory. The trajectory is smoothed (see `smoothTrajectory`),
/// and the smoothed trajectory is the truth. The scene is built around the simulated part of the
/// path. The scene's direction down is the mean y axis of the cameras.
/// @param poses T_world_cam0. The rig's frame is the frame of camera 0.
Simulation makeTrajectorySimulation(const TrajectorySimulationOptions& options,
                                    const std::vector<StampedPose>& poses, const Rig& rig);

}  // namespace efm
