// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/motion/velocity_correction.h"

#include <algorithm>
#include <cmath>

#include "mapping/geometry/timestamp.h"

namespace efm {

Rigid3 VelocityCorrection::displacement(double since_s) const {
  const Eigen::Vector3d rotation = since_s * angular_rad_s;
  const Eigen::Vector3d path = since_s * linear_m_s;
  const double angle = rotation.norm();
  constexpr double kSmallAngle = 1e-4;  // below it the series is exact to rounding
  const double square = angle * angle;
  const bool small = angle < kSmallAngle;
  const double sine = small ? 1 - square / 6 : std::sin(angle) / angle;
  const double cosine = small ? 0.5 - square / 24 : (1 - std::cos(angle)) / square;
  const double rest = small ? 1.0 / 6 - square / 120 : (1 - sine) / square;
  Rigid3 T_rig_true;
  const double half = small ? 0.5 - square / 48 : std::sin(angle / 2) / angle;
  T_rig_true.rotation.w() = std::cos(angle / 2);
  T_rig_true.rotation.vec() = half * rotation;
  T_rig_true.rotation.normalize();
  T_rig_true.translation =
      sine * path + cosine * rotation.cross(path) + rest * rotation.dot(path) * rotation;
  return T_rig_true;
}

Trajectory correctedTrajectory(const Trajectory& trajectory, const Window& window,
                               const VelocityCorrection& correction) {
  const std::int64_t from_ns = std::min(window.t0_ns, window.t_ref_ns);
  const std::int64_t to_ns = std::max(window.t1_ns, window.t_ref_ns);
  Trajectory corrected = trajectory.moved(from_ns, to_ns, [&](const StampedPose& pose) {
    const double since_s = secondsBetween(window.t_ref_ns, pose.t_ns);
    return pose.T_world_rig * correction.displacement(since_s);
  });
  // Between two moved poses, interpolation misses the tracker's pose by a term of second order.
  corrected.add({window.t_ref_ns, trajectory.poseAt(window.t_ref_ns).value()});
  return corrected;
}

}  // namespace efm
