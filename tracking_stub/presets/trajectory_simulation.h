// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "tracking_stub/sensor/simulated_rig.h"

namespace efm {

struct TrajectorySimulationOptions {
  /// One of `simulationScenes`:
  ///   room    a furnished room; its walls are at least 1.9 m from the path;
  ///   street  a street along the path, for vehicles: see makeStreet;
  ///   poles   thin poles before a wall, in the mean viewing direction.
  std::string scene = "room";
  /// Start time in the trajectory's clock. Default: `startOfMotion`.
  std::optional<std::int64_t> start_ns;
  /// Seconds, 0.001 to 600. Default: 5, or less where the trajectory ends earlier.
  std::optional<double> duration_s;
  std::uint64_t seed = 1;

  void validate() const;
};

/// The names of the scenes that can be built around a trajectory.
std::vector<std::string> simulationScenes();

/// Moves a rig along a measured trajectory. The trajectory is smoothed (see `smoothTrajectory`),
/// and the smoothed trajectory is the truth. The scene is built around the simulated part of the
/// path. Its vertical is the mean y axis of the cameras.
/// @param poses T_world_cam0, where camera 0 is the rig's frame.
Simulation makeTrajectorySimulation(const TrajectorySimulationOptions& options,
                                    const std::vector<StampedPose>& poses, const Rig& rig);

}  // namespace efm
