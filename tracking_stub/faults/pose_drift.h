// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "mapping/geometry/rigid3.h"

namespace efm {

/// How far odometry drifts on its way. The default is not at all.
struct PoseDriftOptions {
  double share = 0;      ///< Of the way: metres per metre, 0 to 1.
  double rad_per_m = 0;  ///< By which the heading turns away, 0 to 10.

  bool any() const { return share > 0 || rad_per_m > 0; }
  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// Poses as odometry drifts: it adds up what it saw of the way along a heading that turns away
/// about one axis, and runs away in one direction, both in proportion to the way gone. Axis and
/// direction are unit vectors in the world, drawn from the seed. The way is that of the poses
/// given.
class PoseDrift {
 public:
  /// @throws std::invalid_argument where the options are not valid.
  PoseDrift(const PoseDriftOptions& options, std::uint64_t seed);

  /// The pose in order of time after those before it, as odometry has it. The first one stays.
  Rigid3 drifted(const Rigid3& T_world_rig);

 private:
  PoseDriftOptions options_;
  Eigen::Vector3d direction_world_;
  Eigen::Vector3d axis_world_;
  double way_m_ = 0;
  std::optional<Eigen::Vector3d> true_world_;  // the position of the pose before
  Eigen::Vector3d drifted_world_ = Eigen::Vector3d::Zero();
};

}  // namespace efm
