// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "tracking_stub/sensor/simulated_rig.h"

namespace efm {

/// The truth for maps of a simulated recording: a point per cell of about
/// `Simulation::truth_cell_m` on the true surfaces, frame `world`.
struct TruthClouds {
  std::vector<Eigen::Vector3f> surfaces;  ///< All cells that a pixel saw.
  /// The cells with at least 3 events: a semi-dense map should contain them.
  std::vector<Eigen::Vector3f> edges;
};

/// @param recordings of this simulation, one per camera.
TruthClouds makeTruthClouds(const Simulation& simulation,
                            const std::vector<CameraRecording>& recordings);

}  // namespace efm
