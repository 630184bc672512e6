// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <random>

#include "mapping/geometry/rigid3.h"
#include "maps/refinement/pose_refinement.h"

namespace efm::test {

/// Draws a vector of normal components with standard deviation `sigma`.
inline Eigen::Vector3d drawVector(double sigma, std::mt19937& random) {
  std::normal_distribution<double> normal(0, sigma);
  const double x = normal(random);
  const double y = normal(random);
  return {x, y, normal(random)};
}

/// Draws a small motion: normal translation (metres) and rotation vector (radians).
inline Rigid3 drawMotion(double sigma_m, double sigma_rad, std::mt19937& random) {
  Vector6d difference;
  difference.head<3>() = drawVector(sigma_m, random);
  difference.tail<3>() = drawVector(sigma_rad, random);
  return rigidFromDifference(difference);
}

/// Draws a uniform rotation and a normal translation.
inline Rigid3 drawPose(double sigma_m, std::mt19937& random) {
  std::normal_distribution<double> normal;
  Eigen::Vector4d q;
  for (double& component : q) component = normal(random);
  return {Eigen::Quaterniond(q.normalized()), drawVector(sigma_m, random)};
}

/// Draws a full matrix that is never near singular.
template <int size>
Eigen::Matrix<double, size, size> drawMatrix(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-0.3, 0.3);
  Eigen::Matrix<double, size, size> matrix;
  for (double& component : matrix.reshaped()) component = uniform(random);
  matrix.diagonal().array() += 2;
  return matrix;
}

/// Moves a pose by the components of `poseCovariance`: `d` is a translation (metres) along the axes
/// of the world, and a rotation vector (radians) about them.
inline Rigid3 moved(const Rigid3& T_world_ref, const Vector6d& d) {
  const Rigid3 motion = rigidFromDifference(d);
  return {(motion.rotation * T_world_ref.rotation).normalized(),
          T_world_ref.translation + d.head<3>()};
}

inline double metresApart(const Rigid3& a, const Rigid3& b) {
  return (a.translation - b.translation).norm();
}
inline double radiansApart(const Rigid3& a, const Rigid3& b) {
  return differenceOf(a.inverse() * b).tail<3>().norm();
}
inline bool sameBits(const Rigid3& a, const Rigid3& b) {
  return a.translation == b.translation && a.rotation.coeffs() == b.rotation.coeffs();
}

/// Returns the diagonal covariance of a pose.
inline Matrix6d covarianceOf(double sigma_m, double sigma_rad) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(sigma_m), Eigen::Vector3d::Constant(sigma_rad);
  return sigma.cwiseAbs2().asDiagonal();
}

inline PosePrior priorOf(const Rigid3& T_map_ref, double sigma_m, double sigma_rad) {
  return {T_map_ref, sqrtInformation(covarianceOf(sigma_m, sigma_rad))};
}

}  // namespace efm::test
