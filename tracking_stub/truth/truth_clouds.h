// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "tracking_stub/sensor/simulated_rig.h"

namespace efm {

/// What a map of a simulated recording is compared with: points on the true surfaces, one per cell
/// of about `Simulation::truth_cell_m`, frame `world`.
struct TruthClouds {
  std::vector<Eigen::Vector3f> surfaces;  ///< Every cell that a camera's pixel saw.
  /// Those that fired at least 3 events: what a semi-dense map can be asked to find.
  std::vector<Eigen::Vector3f> edges;
};

/// @param recordings of this simulation, per camera.
TruthClouds makeTruthClouds(const Simulation& simulation,
                            const std::vector<CameraRecording>& recordings);

}  // namespace efm
