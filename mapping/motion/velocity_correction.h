// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "mapping/events/window.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/trajectory.h"

namespace efm {

/// The constant velocity by which a tracker's motion is wrong within one window, in the rig's
/// frame: T_world_true(t) = T_world_rig(t) * displacement(t - t_ref). At the reference time the
/// tracker stays right, so the keyframe keeps its place.
struct VelocityCorrection {
  Eigen::Vector3d linear_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_rad_s = Eigen::Vector3d::Zero();

  /// T_rig_true some time after (before, where negative) the reference: the exponential map of
  /// SE(3), a screw.
  Rigid3 displacement(double since_s) const;
};

/// The motion during a window and around it, corrected: what `trajectory` knows of [t0, t1) and of
/// the reference time, no more and no less.
/// @param trajectory has a pose at the reference time.
Trajectory correctedTrajectory(const Trajectory& trajectory, const Window& window,
                               const VelocityCorrection& correction);

}  // namespace efm
