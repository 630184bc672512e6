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
  ///   room    a furnished room around the way, its walls 1.9 m from it or more;
  ///   street  along the way, for vehicles: see makeStreet;
  ///   poles   thin poles before a wall, where the camera looks on average.
  std::string scene = "room";
  /// Where to begin, in the trajectory's clock; where it gets under way (`departureOf`) if not
  /// given.
  std::optional<std::int64_t> start_ns;
  /// Seconds, 0.001 to 600; 5, or what is left of the trajectory, where not given. A longer
  /// trajectory is cut.
  std::optional<double> duration_s;
  std::uint64_t seed = 1;  ///< Of everything random.

  /// @throws std::invalid_argument naming the field, its value and the allowed values.
  void validate() const;
};

/// The names of the scenes that fit themselves around a trajectory.
std::vector<std::string> simulationScenes();

/// Drives a rig along a measured trajectory, smoothed (see `smoothTrajectory`): the smoothed one is
/// the truth. The scene is built around the stretch that is simulated, upright as the cameras are
/// on average: their mean y axis is down.
/// @param poses T_world_cam0, where camera 0 is the rig's frame.
/// @throws std::invalid_argument where the options are not valid, or not those of the trajectory.
Simulation makeTrajectorySimulation(const TrajectorySimulationOptions& options,
                                    const std::vector<StampedPose>& poses, const Rig& rig);

}  // namespace efm
