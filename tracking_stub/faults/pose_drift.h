// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "mapping/geometry/rigid3.h"

namespace efm {

/// Drift of odometry. The default is none.
struct PoseDriftOptions {
  double fraction = 0;   ///< Of the path length: metres per metre, 0 to 1.
  double rad_per_m = 0;  ///< Rotation of the heading, 0 to 10.

  bool any() const { return fraction > 0 || rad_per_m > 0; }
  void validate() const;
};

/// Adds the drift of odometry to poses. The heading rotates about one axis and the position moves
/// in one direction, both in proportion to the path length so far. Axis and direction are random
/// unit vectors in the world.
class PoseDrift {
 public:
  PoseDrift(const PoseDriftOptions& options, std::uint64_t seed);

  /// The pose with drift. Call it in order of time. The first pose does not change.
  Rigid3 drifted(const Rigid3& T_world_rig);

 private:
  PoseDriftOptions options_;
  Eigen::Vector3d direction_world_;
  Eigen::Vector3d axis_world_;
  double path_length_m_ = 0;
  std::optional<Eigen::Vector3d> true_world_;  // the previous position
  Eigen::Vector3d drifted_world_ = Eigen::Vector3d::Zero();
};

}  // namespace efm
