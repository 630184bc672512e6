// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <optional>
#include <vector>

#include "mapping/base/option.h"
#include "mapping/geometry/rigid3.h"
#include "maps/refinement/refinement_state.h"

namespace efm {

// Decompositions of small symmetric matrices. They are compiled once, in pose_refinement.cpp,
// because each takes the compiler seconds.

/// Returns the lower triangular L with covariance = L L^T.
/// @param covariance positive definite.
Matrix6d choleskyFactor(const Matrix6d& covariance);

/// Returns L^-1 for covariance = L L^T: it scales errors with this covariance to unit covariance.
/// @param covariance positive definite.
Matrix6d sqrtInformation(const Matrix6d& covariance);
Eigen::Matrix3d sqrtInformation(const Eigen::Matrix3d& covariance);

bool isPositiveDefinite(const Eigen::Matrix3d& matrix);

/// @param matrix not singular.
Matrix6d inverseOf(const Matrix6d& matrix);

/// Returns the matrix M with M * w = v x w.
Eigen::Matrix3d crossMatrix(const Eigen::Vector3d& v);

/// matrix = vectors * diag(values) * vectors^T; values ascending.
struct EigenDecomposition {
  Vector6d values;
  Matrix6d vectors;
};
EigenDecomposition eigenDecomposition(const Matrix6d& matrix);

double maxEigenvalue(const Eigen::Matrix3d& matrix);

// The refinement of poses, with Ceres. Poses change on the manifold of rotations and translations,
// Jacobians are automatic, and one thread solves: results do not depend on the machine.

/// A point of the map and the same point of a keyframe. Its error is
/// sqrt_information * (p_map - T_map_ref * p_ref).
struct PointPair {
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();                 ///< Metres, frame `map`.
  Eigen::Vector3d p_ref = Eigen::Vector3d::Zero();                 ///< Metres, frame `ref`.
  Eigen::Matrix3d sqrt_information = Eigen::Matrix3d::Identity();  ///< 1/m, frame `map`.
};

/// The expected pose. The error is
/// sqrt_information * differenceOf(prior.T_map_ref^-1 * T_map_ref).
struct PosePrior {
  Rigid3 T_map_ref;
  Matrix6d sqrt_information = Matrix6d::Zero();
};

struct AlignmentOptions {
  /// Beyond this error, in standard deviations, the weight of a pair falls (Cauchy's loss). Range:
  /// above 0, at most 1000.
  double robust_sigmas = 3;
  int max_iterations = 10;  ///< 1 to 1000.
  /// A solve ends when the sum of squared errors falls by less than this fraction. Range: 0 to 1.
  double min_gain = 1e-8;

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("robust_sigmas", self.robust_sigmas, Allowed::above(0, 1e3, "above 0, at most 1000"));
    visit("max_iterations", self.max_iterations,
          Allowed::from(1, 1000, "from 1 to 1000").notInFiles());
  }
  void validate() const { requireFields(*this); }
};

/// Finds the pose that aligns the points of a keyframe with those of the map: the minimum of the
/// sum of squared errors of all pairs and the prior near the start (Levenberg-Marquardt). The prior
/// determines unobservable directions.
/// @return std::nullopt if the solve fails.
std::optional<Rigid3> alignToMap(const std::vector<PointPair>& pairs, const PosePrior& prior,
                                 const Rigid3& T_map_start, const AlignmentOptions& options);

/// A measurement of one pose relative to another. The error is
/// sqrt_information * differenceOf(T_from_to^-1 * T_world_from^-1 * T_world_to) + offset.
struct RelativePoseFactor {
  std::size_t from = 0;  ///< Number of the pose; differs from `to`.
  std::size_t to = 0;
  Rigid3 T_from_to;
  Matrix6d sqrt_information = Matrix6d::Identity();
  Vector6d offset = Vector6d::Zero();
  /// True if the measurement may be an outlier. Then large errors have less weight (Cauchy's loss).
  bool robust = false;
};

/// Returns the norm of the error of a factor, in standard deviations.
double errorOf(const RelativePoseFactor& factor, const Rigid3& T_world_from,
               const Rigid3& T_world_to);

/// A motion between two poses, and the covariance of its `differenceOf`.
struct MotionEstimate {
  Rigid3 T_from_to;
  Matrix6d covariance = Matrix6d::Identity();
};

/// Returns the motion with the minimum error of a factor.
/// @param open_variance variance of unobservable directions, m^2 and rad^2, above 0.
MotionEstimate motionOf(const RelativePoseFactor& factor, double open_variance);

/// Poses, and the factors between them.
struct PoseGraph {
  std::vector<Rigid3> T_world_node;
  std::vector<bool> fixed;  ///< One per pose.
  std::vector<RelativePoseFactor> factors;
};

struct PoseGraphOptions {
  double robust_sigmas = 3;  ///< Limit of robust factors, as in AlignmentOptions.
  int max_iterations = 20;   ///< 1 to 1000.

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("robust_sigmas", self.robust_sigmas,
          Allowed::above(0, 1e3, "above 0, at most 1000").notInFiles());
    visit("max_iterations", self.max_iterations,
          Allowed::from(1, 1000, "from 1 to 1000").notInFiles());
  }
  void validate() const { requireFields(*this); }
};

/// Moves the poses that are not fixed to the minimum of the sum of squared errors.
/// @return false if the solve fails. Then the poses stay.
bool solvePoseGraph(const PoseGraphOptions& options, PoseGraph& graph);

/// Returns the covariance of a pose that is not fixed, given the fixed poses: of its translation
/// along the axes of the world in metres, then of a rotation vector about these axes in radians.
/// @return std::nullopt if the pose is fixed or unobservable.
std::optional<Matrix6d> poseCovariance(const PoseGraphOptions& options, const PoseGraph& graph,
                                       std::size_t node);

}  // namespace efm
