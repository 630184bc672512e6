// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <optional>

namespace efm {

inline constexpr double kPi = 3.14159265358979323846;

/// Angles are radians everywhere but in files and option keys (`_deg`).
inline constexpr double kRadiansPerDegree = kPi / 180;

/// A rigid transform T_a_b of space: p_a = T_a_b * p_b = rotation * p_b + translation.
/// Neighbouring letters match in every product: T_a_c = T_a_b * T_b_c.
///
/// Invariant: `rotation` has unit norm; code that fills it from outside normalises it.
struct Rigid3 {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< Metres.

  Rigid3 inverse() const {
    const Eigen::Quaterniond inverse_rotation = rotation.conjugate();
    return {inverse_rotation, -(inverse_rotation * translation)};
  }
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation * point + translation;
  }
  Rigid3 operator*(const Rigid3& other) const {
    return {(rotation * other.rotation).normalized(), rotation * other.translation + translation};
  }
};

/// Whether two transforms are the same bit for bit.
inline bool isSame(const Rigid3& T_a_b, const Rigid3& other) {
  return T_a_b.translation == other.translation &&
         T_a_b.rotation.coeffs() == other.rotation.coeffs();
}

/// The pose at `fraction` in [0, 1] between two poses: linear in position, slerp along the shorter
/// arc in rotation.
inline Rigid3 interpolate(const Rigid3& T_a_b0, const Rigid3& T_a_b1, double fraction) {
  return {T_a_b0.rotation.slerp(fraction, T_a_b1.rotation),
          (1.0 - fraction) * T_a_b0.translation + fraction * T_a_b1.translation};
}

/// The rotation about the direction of a vector by its length in radians: the exponential map of
/// SO(3).
inline Eigen::Quaterniond rotationBy(const Eigen::Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  if (angle <= 0) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, rotation_vector / angle));
}

/// Rotations and transforms from the numbers of files, which are rounded.

/// The rotation nearest to a matrix R. R * R^T may differ from the identity by 1e-3 in a number.
/// @return std::nullopt for other matrices, reflections and numbers that are not finite.
std::optional<Eigen::Quaterniond> rotationNear(const Eigen::Matrix3d& R_a_b);
/// The transform nearest to a matrix: its rotation as above. The last row may differ from 0 0 0 1
/// by 1e-3 in a number.
std::optional<Rigid3> transformNear(const Eigen::Matrix4d& T_a_b);
/// Returns the rotation of a quaternion, or std::nullopt unless its length is 1 within 1 %.
std::optional<Eigen::Quaterniond> rotationNear(const Eigen::Quaterniond& rotation);

}  // namespace efm
