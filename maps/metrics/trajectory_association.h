// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mapping/geometry/trajectory.h"

namespace efm {

/// An estimated pose and the true one that was nearest in time.
struct PosePair {
  std::int64_t t_ns = 0;  ///< Of the true pose.
  Rigid3 T_map_rig;       ///< The estimate; its world is called `map`, it may lie elsewhere.
  Rigid3 T_world_rig;     ///< The truth.
};

/// Pairs poses by time as evo does (Grupp, "evo: Python package for the evaluation of odometry and
/// SLAM", 2017): each pose of the trajectory that has fewer (of equally many: the estimate) with
/// the other's pose nearest in time, the earlier of two as near, where they are at most
/// `max_difference_s` apart. In the order of time; poses need not be sorted.
/// @throws std::invalid_argument where `max_difference_s` is negative or not finite.
std::vector<PosePair> associatePoses(std::vector<StampedPose> estimate,
                                     std::vector<StampedPose> truth, double max_difference_s);

}  // namespace efm
