// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/keyframe_registration.h"

#include <algorithm>
#include <cmath>

#include "mapping/base/option.h"
#include "mapping/depth/peak_fit.h"

namespace efm {
namespace {

/// Ratio of the maximum distances of consecutive rounds.
constexpr double kShrink = 0.65;
/// Rounds with all points and the last distance.
constexpr int kLastRounds = 2;
/// Points and iterations of the earlier rounds, whose neighbours are preliminary.
constexpr std::size_t kCoarsePoints = 300;
constexpr int kCoarseIterations = 2;

/// The points of a keyframe with their neighbours in the map.
struct Neighbours {
  std::vector<PointPair> pairs;
  std::vector<std::size_t> map_index;  ///< Index into the map of the keyframe of each pair.
  std::size_t visible = 0;
  std::size_t inliers = 0;
};

/// Returns R * covariance * R^T.
Eigen::Matrix3d rotatedCovariance(const Eigen::Matrix3d& R, const Eigen::Matrix3f& covariance) {
  return R * covariance.cast<double>() * R.transpose();
}

class NeighbourSearch {
 public:
  NeighbourSearch(const RegistrationCloud& cloud, const std::vector<MapKeyframe>& map)
      : cloud_(cloud), map_(map) {
    for (const MapKeyframe& from : map) {
      R_world_from_.push_back(from.T_world_ref.rotation.toRotationMatrix());
    }
  }

  /// @param stride only each stride-th point is used.
  Neighbours find(const Rigid3& T_world_ref, double max_distance_px, std::size_t stride) const {
    Neighbours found;
    const Eigen::Matrix3d R_world_ref = T_world_ref.rotation.toRotationMatrix();
    std::vector<Rigid3> T_from_ref;
    for (const MapKeyframe& from : map_) {
      T_from_ref.push_back(from.T_world_ref.inverse() * T_world_ref);
    }
    for (std::size_t i = 0; i < cloud_.numQueryPoints(); i += stride) {
      const RegistrationPoint& point = cloud_.points()[i];
      const Eigen::Vector3d p_ref = point.p_ref.cast<double>();
      const Eigen::Matrix3d own = rotatedCovariance(R_world_ref, point.covariance);
      const std::size_t before = found.pairs.size();
      bool visible = false;
      for (std::size_t m = 0; m < map_.size(); ++m) {
        const Eigen::Vector3d p_from = T_from_ref[m] * p_ref;
        visible = visible || map_[m].cloud->isInView(p_from);
        const auto index = map_[m].cloud->nearest(p_from, max_distance_px);
        if (!index) continue;
        const RegistrationPoint& neighbour = map_[m].cloud->points()[*index];
        const Eigen::Matrix3d covariance =
            own + rotatedCovariance(R_world_from_[m], neighbour.covariance);
        found.pairs.push_back({map_[m].T_world_ref * neighbour.p_ref.cast<double>(), p_ref,
                               sqrtInformation(covariance)});
        found.map_index.push_back(m);
      }
      const bool inlier = found.pairs.size() > before;
      if (visible || inlier) ++found.visible;
      if (inlier) ++found.inliers;
    }
    return found;
  }

 private:
  const RegistrationCloud& cloud_;
  const std::vector<MapKeyframe>& map_;
  std::vector<Eigen::Matrix3d> R_world_from_;
};

/// Returns the approximate uncertainty of a point in the image by the prior, pixels.
double uncertaintyPx(const RegistrationCloud& cloud, const PosePrior& prior) {
  const Vector6d variances =
      inverseOf(prior.sqrt_information.transpose() * prior.sqrt_information).diagonal();
  const double sigma_m = std::sqrt(variances.head<3>().maxCoeff());
  const double sigma_rad = std::sqrt(variances.tail<3>().maxCoeff());
  return cloud.focalPx() * (sigma_rad + sigma_m * cloud.middleInverseDepth());
}

/// The normal equations of the pairs with one keyframe of the map.
struct NormalEquations {
  Matrix6d information = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
};

/// Returns the factor with the error |A d + b|^2, where A^T A is the information and A^T b the
/// gradient. Unobservable directions have rows of zeros.
RelativePoseFactor factorOf(const NormalEquations& equations, const Rigid3& T_from_to) {
  constexpr double kMinRatio = 1e-9;
  RelativePoseFactor factor;
  factor.T_from_to = T_from_to;
  const EigenDecomposition eigen = eigenDecomposition(equations.information);
  const Vector6d roots = eigen.values.cwiseMax(0).cwiseSqrt();
  const Vector6d gradient = eigen.vectors.transpose() * equations.gradient;
  factor.sqrt_information.setZero();
  for (int i = 0; i < 6; ++i) {
    if (roots[i] <= kMinRatio * roots.maxCoeff()) continue;
    factor.sqrt_information.row(i) = roots[i] * eigen.vectors.col(i).transpose();
    factor.offset[i] = gradient[i] / roots[i];
  }
  return factor;
}

void summarize(const Neighbours& found, const std::vector<MapKeyframe>& map, std::size_t number,
               double robust_sigmas, Registration& registration) {
  const Rigid3& T_world_ref = registration.T_world_ref;
  const Eigen::Matrix3d R_world_ref = T_world_ref.rotation.toRotationMatrix();
  std::vector<NormalEquations> equations(map.size());
  std::vector<bool> has_pairs(map.size());
  std::vector<double> errors;
  for (std::size_t i = 0; i < found.pairs.size(); ++i) {
    const PointPair& pair = found.pairs[i];
    const Eigen::Vector3d error = pair.sqrt_information * (pair.p_map - T_world_ref * pair.p_ref);
    const Eigen::Matrix3d by_ref = pair.sqrt_information * R_world_ref;
    Eigen::Matrix<double, 3, 6> jacobian;  // with respect to a small motion in frame `ref`
    jacobian.leftCols<3>() = -by_ref;
    jacobian.rightCols<3>() = by_ref * crossMatrix(pair.p_ref);
    const double weight = 1 / (1 + error.squaredNorm() / (robust_sigmas * robust_sigmas));
    NormalEquations& sums = equations[found.map_index[i]];
    sums.information += weight * jacobian.transpose() * jacobian;
    sums.gradient += weight * jacobian.transpose() * error;
    has_pairs[found.map_index[i]] = true;
    errors.push_back(error.norm());
  }
  for (std::size_t m = 0; m < map.size(); ++m) {
    if (!has_pairs[m]) continue;
    RelativePoseFactor factor = factorOf(equations[m], map[m].T_world_ref.inverse() * T_world_ref);
    factor.from = map[m].keyframe;
    factor.to = number;
    registration.factors.push_back(factor);
  }
  registration.visible = found.visible;
  registration.inliers = found.inliers;
  if (!errors.empty()) registration.median_error = upperMedian(errors);
}

}  // namespace

void KeyframeRegistrationOptions::validate() const {
  requireFields(*this);
  requireOption(first_distance_px >= last_distance_px && first_distance_px <= 1e4,
                "first_distance_px", first_distance_px, "from last_distance_px to 10000 (pixels)",
                {"last_distance_px"});
}

Registration registerKeyframe(std::size_t number, const RegistrationCloud& cloud,
                              const std::vector<MapKeyframe>& map, const PosePrior& prior,
                              const KeyframeRegistrationOptions& options) {
  const NeighbourSearch search(cloud, map);
  Registration registration;
  Rigid3& T_world_ref = registration.T_world_ref;
  T_world_ref = prior.T_map_ref;
  const auto align = [&](const Neighbours& found, const AlignmentOptions& alignment) {
    const auto aligned = alignToMap(found.pairs, prior, T_world_ref, alignment);
    if (aligned) {
      T_world_ref = *aligned;
    } else {
      ++registration.failed_solves;
    }
    return aligned.has_value();
  };

  AlignmentOptions coarse = options.alignment;
  coarse.max_iterations = std::min(coarse.max_iterations, kCoarseIterations);
  const std::size_t stride = std::max<std::size_t>(1, cloud.numQueryPoints() / kCoarsePoints);
  constexpr double kSigmas = 3;
  double distance_px = std::min(kSigmas * uncertaintyPx(cloud, prior), options.first_distance_px);
  for (; distance_px > options.last_distance_px; distance_px *= kShrink) {
    align(search.find(T_world_ref, distance_px, stride), coarse);
  }
  bool aligned = false;
  for (int round = 0; round < kLastRounds; ++round) {
    aligned = align(search.find(T_world_ref, options.last_distance_px, 1), options.alignment);
  }
  if (!aligned) return registration;

  summarize(search.find(T_world_ref, options.last_distance_px, 1), map, number,
            options.alignment.robust_sigmas, registration);
  registration.from_prior =
      (prior.sqrt_information * differenceOf(prior.T_map_ref.inverse() * T_world_ref)).norm();
  return registration;
}

}  // namespace efm
