// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "mapping/events/window.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/trajectory.h"

namespace efm {

/// The tracker's velocity error, constant within one window, in the rig's frame:
/// T_world_true(t) = T_world_rig(t) * displacement(t - t_ref). The pose at the reference time
/// stays, so the keyframe keeps its pose.
struct VelocityCorrection {
  Eigen::Vector3d linear_m_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_rad_s = Eigen::Vector3d::Zero();

  /// T_rig_true at a time after (negative: before) the reference time: the exponential map of
  /// SE(3), a screw.
  Rigid3 displacement(double since_s) const;
};

/// The corrected motion during a window. It has a pose at the same times of [t0, t1), and at the
/// reference time, as `trajectory`.
/// @param trajectory has a pose at the reference time.
Trajectory correctedTrajectory(const Trajectory& trajectory, const Window& window,
                               const VelocityCorrection& correction);

}  // namespace efm
