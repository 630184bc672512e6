// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "maps/refinement/pose_difference.h"

namespace efm {

// Everything that Ceres solves. Poses change on the manifold of their rotations and translations,
// Jacobians are automatic, one thread: the same result wherever it runs.

/// A point of the map and one of a keyframe that are taken to be the same. Its error is
/// sqrt_information * (p_map - T_map_ref * p_ref).
struct PointPair {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();                 ///< Metres, frame `map`.
  Eigen::Vector3d p_ref = Eigen::Vector3d::Zero();                 ///< Metres, frame `ref`.
  Eigen::Matrix3d sqrt_information = Eigen::Matrix3d::Identity();  ///< 1/m, frame `map`.
};

/// Where a pose is expected. The error is
/// sqrt_information * differenceOf(prior.T_map_ref^-1 * T_map_ref).
struct PosePrior {
  Rigid3 T_map_ref;
  Matrix6d sqrt_information = Matrix6d::Zero();
};

struct AlignmentOptions {
  /// Errors of a pair in standard deviations beyond which it counts less and less (Cauchy's loss).
  /// Range: above 0, at most 1000.
  double robust_sigmas = 3;
  int max_iterations = 10;  ///< 1 to 1000.
  /// An iteration that takes away less than this share of the errors' squares is the last one.
  /// Range: 0 to 1.
  double min_gain = 1e-8;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// The pose that brings a keyframe's points onto those of the map: where all errors together are
/// least, found by Levenberg and Marquardt's method from a pose near by. What the pairs leave open
/// stays with the prior. Where that cannot be computed the start is the result.
Rigid3 alignToMap(const std::vector<PointPair>& pairs, const PosePrior& prior,
                  const Rigid3& T_map_start, const AlignmentOptions& options);

/// Something that is known of two poses by each other. The error is
/// sqrt_information * differenceOf(T_from_to^-1 * T_world_from^-1 * T_world_to) + offset.
struct RelativePoseFactor {
  std::size_t from = 0;  ///< Number of the pose; not that of `to`.
  std::size_t to = 0;
  Rigid3 T_from_to;
  Matrix6d sqrt_information = Matrix6d::Identity();
  Vector6d offset = Vector6d::Zero();
  /// Whether it may be wrong altogether: then large errors count less (Cauchy's loss).
  bool robust = false;
};

/// The length of a factor's error: standard deviations, where it has that many.
double errorOf(const RelativePoseFactor& factor, const Rigid3& T_world_from,
               const Rigid3& T_world_to);

/// A motion between two poses, and of its `differenceOf` the covariance.
struct MotionEstimate {
  Rigid3 T_from_to;
  Matrix6d covariance = Matrix6d::Identity();
};

/// Where a factor's error is least.
/// @param open_variance of what the factor leaves open, m^2 and rad^2: above 0.
MotionEstimate motionOf(const RelativePoseFactor& factor, double open_variance);

/// Poses, and what is known of them by each other.
struct PoseGraph {
  std::vector<Rigid3> T_world_node;
  std::vector<bool> fixed;  ///< One per pose.
  std::vector<RelativePoseFactor> factors;
};

struct PoseGraphOptions {
  double robust_sigmas = 3;  ///< Of robust factors; as above.
  int max_iterations = 20;   ///< 1 to 1000.

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// Moves the poses that are not fixed to where the factors' errors together are least. Where that
/// cannot be computed the poses stay.
void solvePoseGraph(const PoseGraphOptions& options, PoseGraph& graph);

/// Covariance of a pose that is not fixed, given those that are: of a small motion of it, the
/// translation along the world's axes in metres, then a rotation vector about them in radians.
/// @return nothing where the factors leave it open.
std::optional<Matrix6d> poseCovariance(const PoseGraphOptions& options, const PoseGraph& graph,
                                       std::size_t node);

/// How a pair's error changes with small motions of the pose, as `poseCovariance` has them: what
/// the solver goes by.
Eigen::Matrix<double, 3, 6> pairJacobian(const PointPair& pair, const Rigid3& T_map_ref);

/// The same of a factor: by the motion of `from`, then by that of `to`.
Eigen::Matrix<double, 6, 12> factorJacobian(const RelativePoseFactor& factor,
                                            const Rigid3& T_world_from, const Rigid3& T_world_to);

}  // namespace efm
