// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/camera_motion.h"

#include <cmath>
#include <limits>

namespace efm {

CameraMotion::CameraMotion(const TrajectorySegment& segment, const Rigid3& T_ref_world,
                           const Rigid3& T_rig_cam)
    : first_ns_(segment.first.t_ns) {
  const std::int64_t length_ns = segment.last.t_ns - first_ns_;
  if (length_ns > 0) per_ns_ = 1.0 / static_cast<double>(length_ns);
  const Rigid3 T_ref_rig0 = T_ref_world * segment.first.T_world_rig;
  const Rigid3 T_ref_rig1 = T_ref_world * segment.last.T_world_rig;
  R_ref_cam0_ = (T_ref_rig0.rotation * T_rig_cam.rotation).normalized();
  R_ref_cam1_ = (T_ref_rig1.rotation * T_rig_cam.rotation).normalized();
  rig0_ref_ = T_ref_rig0.translation;
  step_ref_ = T_ref_rig1.translation - rig0_ref_;
  lever_cam_ = T_rig_cam.rotation.conjugate() * T_rig_cam.translation;

  double cosine = R_ref_cam0_.dot(R_ref_cam1_);
  if (cosine < 0) {
    R_ref_cam1_.coeffs() = -R_ref_cam1_.coeffs();
    cosine = -cosine;
  }
  if (cosine >= 1 - std::numeric_limits<double>::epsilon()) return;
  angle_ = std::acos(cosine);
  sine_ = std::sin(angle_);
}

Rigid3 CameraMotion::poseAt(std::int64_t t_ns) const {
  const double fraction = per_ns_ * static_cast<double>(t_ns - first_ns_);
  const bool rotates = sine_ > 0;
  const double weight0 = rotates ? std::sin((1 - fraction) * angle_) / sine_ : 1 - fraction;
  const double weight1 = rotates ? std::sin(fraction * angle_) / sine_ : fraction;
  Rigid3 T_ref_cam;
  T_ref_cam.rotation.coeffs() = weight0 * R_ref_cam0_.coeffs() + weight1 * R_ref_cam1_.coeffs();
  T_ref_cam.rotation.normalize();
  T_ref_cam.translation = rig0_ref_ + fraction * step_ref_ + T_ref_cam.rotation * lever_cam_;
  return T_ref_cam;
}

}  // namespace efm
