// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mapping/geometry/trajectory.h"

namespace efm {

/// An estimated pose and the true pose that is nearest in time.
struct PosePair {
  std::int64_t t_ns = 0;  ///< Of the true pose.
  Rigid3 T_map_rig;       ///< The estimate. Its world is called `map` and may lie elsewhere.
  Rigid3 T_world_rig;     ///< The truth.
};

/// Pairs poses by time like evo (Grupp, "evo: Python package for the evaluation of odometry and
/// SLAM", 2017). Each pose of the shorter trajectory (of the estimate, if both have as many poses)
/// is paired with the pose of the other trajectory that is nearest in time; of two at the same
/// distance, the earlier one. Poses more than `max_difference_s` apart are not paired. The input
/// need not be sorted; the result is.
/// @throws std::invalid_argument where `max_difference_s` is negative or not finite.
std::vector<PosePair> associatePoses(std::vector<StampedPose> estimate,
                                     std::vector<StampedPose> truth, double max_difference_s);

}  // namespace efm
