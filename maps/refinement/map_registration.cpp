// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/map_registration.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "maps/refinement/keyframe_registration.h"
#include "maps/refinement/loop_closing.h"
#include "maps/refinement/pose_refinement.h"

namespace efm {
namespace {

constexpr std::size_t kPartners = 3;  // of each keyframe
constexpr std::size_t kMinMapPairs = 3;
constexpr double kDepthShare = 0.03;  // the expected displacement, by the scene's depth
constexpr double kSigmaRad = 2 * kRadiansPerDegree;
constexpr double kAgreeSigmas = 3;

/// Returns the matrix A for which a small motion d, right of X, is A d right of X * T.
Matrix6d adjointOf(const Rigid3& T) {
  const Eigen::Matrix3d R = T.rotation.toRotationMatrix().transpose();
  Matrix6d A = Matrix6d::Zero();
  A.topLeftCorner<3, 3>() = A.bottomRightCorner<3, 3>() = R;
  A.topRightCorner<3, 3>() = -R * crossMatrix(T.translation);
  return A;
}

/// Returns the indices of the keyframes that see most of a keyframe.
std::vector<std::size_t> partnersOf(const PosedCloud& keyframe, const std::vector<PosedCloud>& in,
                                    double min_overlap) {
  std::vector<std::pair<double, std::size_t>> overlaps;
  for (std::size_t i = 0; i < in.size(); ++i) {
    const double overlap = viewOverlap(keyframe.cloud, in[i].cloud,
                                       in[i].T_world_ref.inverse() * keyframe.T_world_ref);
    if (overlap >= min_overlap) overlaps.emplace_back(-overlap, i);
  }
  std::sort(overlaps.begin(), overlaps.end());
  std::vector<std::size_t> partners;
  for (std::size_t i = 0; i < std::min(overlaps.size(), kPartners); ++i) {
    partners.push_back(overlaps[i].second);
  }
  return partners;
}

}  // namespace

MapRegistration registerMap(const std::vector<PosedCloud>& fixed,
                            const std::vector<PosedCloud>& moved) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const PosedCloud& keyframe : moved) middle += keyframe.T_world_ref.translation;
  middle /= std::max<double>(1, static_cast<double>(moved.size()));
  const Rigid3 T_world_middle{Eigen::Quaterniond::Identity(), middle};

  // The last pose is that of the moved map about its middle.
  PoseGraph graph;
  for (const PosedCloud& keyframe : fixed) graph.T_world_node.push_back(keyframe.T_world_ref);
  graph.fixed.assign(fixed.size(), true);
  graph.T_world_node.push_back(T_world_middle);
  graph.fixed.push_back(false);
  MapRegistration registration;
  for (std::size_t i = 0; i < moved.size(); ++i) {
    const PosedCloud& keyframe = moved[i];
    LoopOptions options;
    const double depth_m = 1 / std::max(keyframe.cloud.middleInverseDepth(), 1e-9);
    options.loop_max_sigma_m = std::max(options.loop_max_sigma_m, kDepthShare * depth_m / 3);
    Matrix6d covariance = Matrix6d::Identity() * kSigmaRad * kSigmaRad;
    covariance.topLeftCorner<3, 3>() *= std::pow(kDepthShare * depth_m / kSigmaRad, 2);
    for (const std::size_t partner : partnersOf(keyframe, fixed, options.loop_min_overlap)) {
      ++registration.checked;
      const LoopCandidate candidate{partner, fixed.size(),
                                    fixed[partner].T_world_ref.inverse() * keyframe.T_world_ref};
      LoopCheck check = verifyLoop(candidate, fixed[partner].cloud, keyframe.cloud, covariance,
                                   options, KeyframeRegistrationOptions());
      if (!check.factor) continue;
      const Rigid3 T_middle_ref = T_world_middle.inverse() * keyframe.T_world_ref;
      check.factor->T_from_to = check.factor->T_from_to * T_middle_ref.inverse();
      check.factor->sqrt_information = check.factor->sqrt_information * adjointOf(T_middle_ref);
      graph.factors.push_back(*check.factor);
    }
    keyframe.cloud.releaseTree();
  }
  if (graph.factors.size() < kMinMapPairs || !solvePoseGraph(PoseGraphOptions(), graph)) {
    throw std::runtime_error(
        "the maps cannot be registered: " + std::to_string(graph.factors.size()) + " of " +
        std::to_string(registration.checked) +
        " pairs of keyframes fit on each other: expected maps of one place, "
        "at most 10 % of its depth and 6 degrees apart");
  }
  const Rigid3 T_world_moved = graph.T_world_node.back();
  registration.T_fixed_moved = T_world_moved * T_world_middle.inverse();
  double squared_errors = 0;
  for (const RelativePoseFactor& factor : graph.factors) {
    const double error = errorOf(factor, graph.T_world_node[factor.from], T_world_moved);
    if (error > kAgreeSigmas * std::sqrt(6.)) continue;
    ++registration.pairs;
    squared_errors += error * error;
  }
  if (2 * registration.pairs < graph.factors.size()) {
    throw std::runtime_error("the maps cannot be registered: their keyframes do not agree");
  }
  const auto covariance = poseCovariance(PoseGraphOptions(), graph, fixed.size());
  const double scale =
      std::sqrt(std::max(1., squared_errors / static_cast<double>(6 * registration.pairs)));
  registration.moved_m = (T_world_moved.translation - middle).norm();
  registration.moved_rad = T_world_moved.rotation.angularDistance(Eigen::Quaterniond::Identity());
  if (covariance) {
    registration.sigma_m =
        scale * std::sqrt(maxEigenvalue(Eigen::Matrix3d(covariance->topLeftCorner<3, 3>())));
    registration.sigma_rad =
        scale * std::sqrt(maxEigenvalue(Eigen::Matrix3d(covariance->bottomRightCorner<3, 3>())));
  }
  return registration;
}

}  // namespace efm
