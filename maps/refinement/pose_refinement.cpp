// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/pose_refinement.h"

#include <ceres/autodiff_cost_function.h>
#include <ceres/covariance.h>
#include <ceres/loss_function.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/product_manifold.h>
#include <ceres/rotation.h>
#include <ceres/solver.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "mapping/base/option.h"

namespace efm {
namespace {

/// Returns the Cholesky factor of a 3 x 3 matrix. If the matrix is not positive definite, a value
/// on its diagonal is not above 0 or not a number.
Eigen::Matrix3d factorOf(const Eigen::Matrix3d& a) {
  Eigen::Matrix3d l = Eigen::Matrix3d::Zero();
  l(0, 0) = std::sqrt(a(0, 0));
  l(1, 0) = a(1, 0) / l(0, 0);
  l(2, 0) = a(2, 0) / l(0, 0);
  l(1, 1) = std::sqrt(a(1, 1) - l(1, 0) * l(1, 0));
  l(2, 1) = (a(2, 1) - l(2, 0) * l(1, 0)) / l(1, 1);
  l(2, 2) = std::sqrt(a(2, 2) - (l(2, 0) * l(2, 0) + l(2, 1) * l(2, 1)));
  return l;
}

}  // namespace

Matrix6d choleskyFactor(const Matrix6d& covariance) { return covariance.llt().matrixL(); }

Matrix6d sqrtInformation(const Matrix6d& covariance) {
  return covariance.llt().matrixL().solve(Matrix6d::Identity());
}

Eigen::Matrix3d sqrtInformation(const Eigen::Matrix3d& covariance) {
  const Eigen::Matrix3d l = factorOf(covariance);
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Identity();
  for (int column = 0; column < 3; ++column) {  // forward substitution
    for (int row = column; row < 3; ++row) {
      inverse(row, column) *= 1 / l(row, row);
      for (int below = row + 1; below < 3; ++below) {
        inverse(below, column) -= inverse(row, column) * l(below, row);
      }
    }
  }
  return inverse;
}

bool isPositiveDefinite(const Eigen::Matrix3d& matrix) {
  return (factorOf(matrix).diagonal().array() > 0).all();
}

Matrix6d inverseOf(const Matrix6d& matrix) { return matrix.inverse(); }

Eigen::Matrix3d crossMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return matrix;
}

EigenDecomposition eigenDecomposition(const Matrix6d& matrix) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

double maxEigenvalue(const Eigen::Matrix3d& matrix) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(matrix).eigenvalues().maxCoeff();
}

namespace {

// Checked before solving: Ceres prints messages about numbers that are not finite.
bool isFinite(const Rigid3& pose) {
  return pose.translation.allFinite() && pose.rotation.coeffs().allFinite();
}

bool isFinite(const PointPair& pair) {
  return pair.p_map.allFinite() && pair.p_ref.allFinite() && pair.sqrt_information.allFinite();
}

bool isFinite(const RelativePoseFactor& factor) {
  return isFinite(factor.T_from_to) && factor.sqrt_information.allFinite() &&
         factor.offset.allFinite();
}

bool isFinite(const PoseGraph& graph) {
  const auto finite = [](const auto& value) { return isFinite(value); };
  return std::all_of(graph.T_world_node.begin(), graph.T_world_node.end(), finite) &&
         std::all_of(graph.factors.begin(), graph.factors.end(), finite);
}

/// The parameters of a pose: the quaternion (x, y, z, w), then the translation.
constexpr int kPoseSize = 7;
using PoseBlock = std::array<double, kPoseSize>;

PoseBlock blockOf(const Rigid3& T_a_b) {
  const Eigen::Vector4d q = T_a_b.rotation.coeffs();
  const Eigen::Vector3d& t = T_a_b.translation;
  return {q[0], q[1], q[2], q[3], t[0], t[1], t[2]};
}

Rigid3 rigidOf(const PoseBlock& block) {
  return {Eigen::Quaterniond(block.data()).normalized(),
          Eigen::Map<const Eigen::Vector3d>(block.data() + 4)};
}

// T is double, or a number with its derivatives.
template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
template <typename T>
using Vector6 = Eigen::Matrix<T, 6, 1>;

template <typename T>
struct Pose {
  Eigen::Quaternion<T> rotation;
  Vector3<T> translation;

  explicit Pose(const T* block) : rotation(block), translation(block[4], block[5], block[6]) {}
};

template <typename T>
Vector3<T> rotationVectorOf(const Eigen::Quaternion<T>& rotation) {
  const std::array<T, 4> scalar_first = {rotation.w(), rotation.x(), rotation.y(), rotation.z()};
  Vector3<T> rotation_vector;
  ceres::QuaternionToAngleAxis(scalar_first.data(), rotation_vector.data());
  return rotation_vector;
}

/// Returns differenceOf(T_from_to^-1 * T_world_from^-1 * T_world_to).
template <typename T>
Vector6<T> differenceBetween(const Rigid3& T_from_to, const Pose<T>& from, const Pose<T>& to) {
  const Eigen::Quaternion<T> R_from_world = from.rotation.conjugate();
  const Eigen::Quaternion<T> R_to_from = T_from_to.rotation.cast<T>().conjugate();
  const Vector3<T> p_from = R_from_world * (to.translation - from.translation);
  Vector6<T> difference;
  difference.template head<3>() = R_to_from * Vector3<T>(p_from - T_from_to.translation.cast<T>());
  difference.template tail<3>() = rotationVectorOf<T>(R_to_from * (R_from_world * to.rotation));
  return difference;
}

struct PairError {
  PointPair pair;

  template <typename T>
  bool operator()(const T* block, T* error) const {
    const Pose<T> pose(block);
    const Vector3<T> p_ref = pair.p_ref.cast<T>();
    const Vector3<T> distance = pair.p_map.cast<T>() - (pose.rotation * p_ref + pose.translation);
    Eigen::Map<Vector3<T>> result(error);
    result = pair.sqrt_information.cast<T>() * distance;
    return true;
  }
};

struct FactorError {
  RelativePoseFactor factor;

  template <typename T>
  bool operator()(const T* from, const T* to, T* error) const {
    Eigen::Map<Vector6<T>> result(error);
    result = factor.sqrt_information.cast<T>() *
                 differenceBetween(factor.T_from_to, Pose<T>(from), Pose<T>(to)) +
             factor.offset.cast<T>();
    return true;
  }
};

using PairCost = ceres::AutoDiffCostFunction<PairError, 3, kPoseSize>;
using FactorCost = ceres::AutoDiffCostFunction<FactorError, 6, kPoseSize, kPoseSize>;

using PoseManifold =
    ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>>;

ceres::Problem::Options borrowing() {
  ceres::Problem::Options options;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
}

ceres::Solver::Options solverOptions(int max_iterations, ceres::LinearSolverType solver) {
  ceres::Solver::Options options;
  options.max_num_iterations = max_iterations;
  options.linear_solver_type = solver;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  // This tolerance is relative to the parameters: far from the origin it would stop too early.
  options.parameter_tolerance = 0;
  return options;
}

/// A graph as a problem of Ceres. Not copied: the problem points into it.
class GraphProblem {
 public:
  GraphProblem(const PoseGraph& graph, double robust_sigmas)
      : loss_(robust_sigmas), problem_(borrowing()) {
    for (const Rigid3& pose : graph.T_world_node) blocks_.push_back(blockOf(pose));
    for (const RelativePoseFactor& factor : graph.factors) {
      if (graph.fixed[factor.from] && graph.fixed[factor.to]) continue;
      problem_.AddResidualBlock(new FactorCost(new FactorError{factor}),
                                factor.robust ? &loss_ : nullptr, blocks_[factor.from].data(),
                                blocks_[factor.to].data());
    }
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
      if (!has(i)) continue;
      problem_.SetManifold(blocks_[i].data(), &manifold_);
      if (graph.fixed[i]) problem_.SetParameterBlockConstant(blocks_[i].data());
    }
  }
  GraphProblem(const GraphProblem&) = delete;
  GraphProblem& operator=(const GraphProblem&) = delete;

  bool empty() const { return problem_.NumResidualBlocks() == 0; }
  bool has(std::size_t node) const { return problem_.HasParameterBlock(blocks_[node].data()); }
  const PoseBlock& block(std::size_t node) const { return blocks_[node]; }
  ceres::Problem& problem() { return problem_; }

 private:
  std::vector<PoseBlock> blocks_;
  PoseManifold manifold_;
  ceres::CauchyLoss loss_;
  ceres::Problem problem_;  // last, because it points to the others
};

}  // namespace

std::optional<Rigid3> alignToMap(const std::vector<PointPair>& pairs, const PosePrior& prior,
                                 const Rigid3& T_map_start, const AlignmentOptions& options) {
  // The prior is a factor between the fixed origin of the map and the pose.
  const RelativePoseFactor factor{0, 1, prior.T_map_ref, prior.sqrt_information};
  if (!std::all_of(pairs.begin(), pairs.end(), [](const auto& pair) { return isFinite(pair); }) ||
      !isFinite(factor) || !isFinite(T_map_start)) {
    return std::nullopt;
  }
  PoseBlock pose = blockOf(T_map_start);
  PoseManifold manifold;
  ceres::CauchyLoss loss(options.robust_sigmas);
  ceres::Problem problem(borrowing());
  problem.AddParameterBlock(pose.data(), kPoseSize, &manifold);
  for (const PointPair& pair : pairs) {
    problem.AddResidualBlock(new PairCost(new PairError{pair}), &loss, pose.data());
  }
  PoseBlock origin = blockOf(Rigid3{});
  problem.AddResidualBlock(new FactorCost(new FactorError{factor}), nullptr, origin.data(),
                           pose.data());
  problem.SetParameterBlockConstant(origin.data());
  ceres::Solver::Summary summary;
  ceres::Solver::Options solver =
      solverOptions(options.max_iterations, ceres::DENSE_NORMAL_CHOLESKY);
  solver.function_tolerance = options.min_gain;
  ceres::Solve(solver, &problem, &summary);
  if (!summary.IsSolutionUsable()) return std::nullopt;
  return rigidOf(pose);
}

double errorOf(const RelativePoseFactor& factor, const Rigid3& T_world_from,
               const Rigid3& T_world_to) {
  const Rigid3 T_from_to = T_world_from.inverse() * T_world_to;
  return (factor.sqrt_information * differenceOf(factor.T_from_to.inverse() * T_from_to) +
          factor.offset)
      .norm();
}

MotionEstimate motionOf(const RelativePoseFactor& factor, double open_variance) {
  const Matrix6d information = factor.sqrt_information.transpose() * factor.sqrt_information +
                               1 / open_variance * Matrix6d::Identity();
  MotionEstimate motion;
  motion.covariance = inverseOf(information);
  const Vector6d to_minimum =
      -motion.covariance * (factor.sqrt_information.transpose() * factor.offset);
  motion.T_from_to = factor.T_from_to * rigidFromDifference(to_minimum);
  return motion;
}

bool solvePoseGraph(const PoseGraphOptions& options, PoseGraph& graph) {
  if (!isFinite(graph)) return false;
  GraphProblem problem(graph, options.robust_sigmas);
  if (problem.empty()) return true;
  ceres::Solver::Summary summary;
  ceres::Solve(solverOptions(options.max_iterations, ceres::SPARSE_NORMAL_CHOLESKY),
               &problem.problem(), &summary);
  if (!summary.IsSolutionUsable()) return false;
  for (std::size_t i = 0; i < graph.T_world_node.size(); ++i) {
    if (!graph.fixed[i] && problem.has(i)) graph.T_world_node[i] = rigidOf(problem.block(i));
  }
  return true;
}

std::optional<Matrix6d> poseCovariance(const PoseGraphOptions& options, const PoseGraph& graph,
                                       std::size_t node) {
  if (!isFinite(graph)) return std::nullopt;
  GraphProblem problem(graph, options.robust_sigmas);
  if (graph.fixed[node] || !problem.has(node)) return std::nullopt;
  ceres::Covariance::Options of_solver;
  of_solver.num_threads = 1;
  ceres::Covariance covariance(of_solver);
  const double* block = problem.block(node).data();
  const std::vector<std::pair<const double*, const double*>> blocks = {{block, block}};
  if (!covariance.Compute(blocks, &problem.problem())) return std::nullopt;
  Eigen::Matrix<double, 6, 6, Eigen::RowMajor> of_manifold;
  covariance.GetCovarianceBlockInTangentSpace(block, block, of_manifold.data());
  // Takes small motions on the manifold to ours. The manifold has half a rotation vector about the
  // axes of the world, then a translation along them. Ours are the translation, then the whole
  // rotation vector.
  Matrix6d own = Matrix6d::Zero();
  own.topRightCorner<3, 3>().setIdentity();
  own.bottomLeftCorner<3, 3>() = 2 * Eigen::Matrix3d::Identity();
  return own * of_manifold * own.transpose();
}

}  // namespace efm
