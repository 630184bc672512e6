// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cstddef>
#include <optional>

namespace efm {

inline constexpr double kPi = 3.14159265358979323846;

/// Angles are in radians everywhere, except in files and option keys (`_deg`).
inline constexpr double kRadiansPerDegree = kPi / 180;

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// A rigid transform T_a_b of space: p_a = T_a_b * p_b = rotation * p_b + translation.
/// Neighbouring letters match in every product: T_a_c = T_a_b * T_b_c.
///
/// Invariant: `rotation` has unit norm. Code that sets it from outside must normalise it.
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

/// Returns whether two transforms are the same bit for bit.
inline bool isSame(const Rigid3& T_a_b, const Rigid3& other) {
  return T_a_b.translation == other.translation &&
         T_a_b.rotation.coeffs() == other.rotation.coeffs();
}

/// Returns the pose at `fraction` in [0, 1] between two poses: linear in position, slerp along the
/// shorter arc in rotation.
inline Rigid3 interpolate(const Rigid3& T_a_b0, const Rigid3& T_a_b1, double fraction) {
  return {T_a_b0.rotation.slerp(fraction, T_a_b1.rotation),
          (1.0 - fraction) * T_a_b0.translation + fraction * T_a_b1.translation};
}

/// Returns the rotation about a vector by its length in radians: the exponential map of SO(3).
inline Eigen::Quaterniond rotationBy(const Eigen::Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  if (angle <= 0) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, rotation_vector / angle));
}

/// Returns the motion T_a_b as six numbers: the translation in metres, then the rotation vector
/// (axis times angle, at most pi) in radians. Covariances and informations have the same order.
Vector6d differenceOf(const Rigid3& T_a_b);

/// Returns the distance of two poses, metres and radians together: the motion of a point at 1 m.
double distanceBetween(const Rigid3& a, const Rigid3& b);

/// Inverts `differenceOf`.
Rigid3 rigidFromDifference(const Vector6d& difference);

/// Functions for rotations and transforms from files, whose numbers are rounded.

/// Returns the rotation nearest to a matrix R. Each element of R * R^T may differ from the identity
/// by 1e-3. @return std::nullopt for other matrices, reflections and non-finite numbers.
std::optional<Eigen::Quaterniond> rotationNear(const Eigen::Matrix3d& R_a_b);
/// Returns the transform nearest to a matrix; its rotation as above. Each number of the last row
/// may differ from 0 0 0 1 by 1e-3. @return std::nullopt for other matrices.
std::optional<Rigid3> transformNear(const Eigen::Matrix4d& T_a_b);
/// Returns the rotation of a quaternion whose length is 1 within 1 %; std::nullopt for others.
std::optional<Eigen::Quaterniond> rotationNear(const Eigen::Quaterniond& rotation);

/// The position and the quaternion x y z w of a transform.
using PoseNumbers = std::array<double, 7>;
/// Returns the transform of 7 numbers, `PoseNumbers`, or of 16, a matrix row by row.
/// @throws std::runtime_error for other counts, numbers that are not finite, and rotations that are
/// not near enough, as above.
Rigid3 transformOf(const double* numbers, std::size_t count);
template <typename Numbers>
Rigid3 transformOf(const Numbers& numbers) {
  return transformOf(numbers.data(), numbers.size());
}

}  // namespace efm
