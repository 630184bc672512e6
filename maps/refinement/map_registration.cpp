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

constexpr int kRounds = 3;
constexpr std::size_t kPartners = 3;     // of each keyframe
constexpr std::size_t kMinMapPairs = 2;  // of more than one
/// The expected displacement: a share of the scene's depth, and an angle.
constexpr double kDepthShare = 0.03;
constexpr double kSigmaRad = 2 * kRadiansPerDegree;
/// Lower than for loops: views of a forward motion share few points, and pairs must agree.
constexpr double kMinInliers = 0.15;
constexpr double kAgreeSigmas = 4.5;  // 1 of 400 errors of six numbers is larger

/// Returns the matrix A for which a small motion d, right of X, is A d right of X * T.
Matrix6d adjointOf(const Rigid3& T) {
  const Eigen::Matrix3d R = T.rotation.toRotationMatrix().transpose();
  Matrix6d A = Matrix6d::Zero();
  A.topLeftCorner<3, 3>() = A.bottomRightCorner<3, 3>() = R;
  A.topRightCorner<3, 3>() = -R * crossMatrix(T.translation);
  return A;
}

/// Returns the indices of the keyframes that see most of a keyframe.
std::vector<std::size_t> partnersOf(const RegistrationCloud& keyframe, const Rigid3& T_world_ref,
                                    const std::vector<PosedCloud>& in, double min_overlap) {
  std::vector<std::pair<double, std::size_t>> overlaps;
  for (std::size_t i = 0; i < in.size(); ++i) {
    const double overlap =
        viewOverlap(keyframe, in[i].cloud, in[i].T_world_ref.inverse() * T_world_ref);
    if (overlap >= min_overlap) overlaps.emplace_back(-overlap, i);
  }
  std::sort(overlaps.begin(), overlaps.end());
  std::vector<std::size_t> partners;
  for (std::size_t i = 0; i < std::min(overlaps.size(), kPartners); ++i) {
    partners.push_back(overlaps[i].second);
  }
  return partners;
}

/// The pairs of keyframes that fit on each other, in a graph of poses. The last one is that of the
/// moved map about its middle; the others are fixed.
struct Pairs {
  PoseGraph graph;
  std::size_t checked = 0;
};

/// @param T_fixed_moved what is known so far.
Pairs pairsOf(const std::vector<PosedCloud>& fixed, const std::vector<PosedCloud>& moved,
              const Rigid3& T_moved_middle, const Rigid3& T_fixed_moved) {
  Pairs pairs;
  for (const PosedCloud& keyframe : fixed) {
    pairs.graph.T_world_node.push_back(keyframe.T_world_ref);
  }
  pairs.graph.fixed.assign(fixed.size(), true);
  pairs.graph.T_world_node.push_back(T_fixed_moved * T_moved_middle);
  pairs.graph.fixed.push_back(false);
  for (const PosedCloud& keyframe : moved) {
    const double depth_m = 1 / std::max(keyframe.cloud.middleInverseDepth(), 1e-9);
    LoopOptions options;
    options.loop_min_inliers = kMinInliers;
    options.loop_max_sigma_m = std::max(options.loop_max_sigma_m, kDepthShare * depth_m / 3);
    Matrix6d covariance = Matrix6d::Identity() * kSigmaRad * kSigmaRad;
    covariance.topLeftCorner<3, 3>() *= std::pow(kDepthShare * depth_m / kSigmaRad, 2);
    const Rigid3 T_fixed_ref = T_fixed_moved * keyframe.T_world_ref;
    for (const std::size_t partner :
         partnersOf(keyframe.cloud, T_fixed_ref, fixed, options.loop_min_overlap)) {
      ++pairs.checked;
      const LoopCheck check = verifyLoop(
          {partner, fixed.size(), fixed[partner].T_world_ref.inverse() * T_fixed_ref},
          fixed[partner].cloud, keyframe.cloud, covariance, options, KeyframeRegistrationOptions());
      if (!check.factor) continue;
      const Rigid3 T_middle_ref = T_moved_middle.inverse() * keyframe.T_world_ref;
      RelativePoseFactor& factor = pairs.graph.factors.emplace_back(*check.factor);
      factor.T_from_to = factor.T_from_to * T_middle_ref.inverse();
      factor.sqrt_information = factor.sqrt_information * adjointOf(T_middle_ref);
    }
    keyframe.cloud.releaseTree();
  }
  return pairs;
}

}  // namespace

MapRegistration registerMap(const std::vector<PosedCloud>& fixed,
                            const std::vector<PosedCloud>& moved) {
  Rigid3 T_moved_middle;
  for (const PosedCloud& keyframe : moved) {
    T_moved_middle.translation +=
        keyframe.T_world_ref.translation / static_cast<double>(moved.size());
  }
  MapRegistration registration;
  Pairs pairs;
  for (int round = 0; round < kRounds; ++round) {  // the first may find few pairs, far from there
    pairs = pairsOf(fixed, moved, T_moved_middle, registration.T_fixed_moved);
    if (pairs.graph.factors.size() <
            std::max<std::size_t>(1, std::min(kMinMapPairs, pairs.checked)) ||
        !solvePoseGraph(PoseGraphOptions(), pairs.graph)) {
      throw std::runtime_error(
          "it cannot be registered: " + std::to_string(pairs.graph.factors.size()) + " of " +
          std::to_string(pairs.checked) +
          " pairs of keyframes fit on each other: expected maps of one place, at most 5 % of its "
          "depth and 3 degrees apart (--transform)");
    }
    registration.T_fixed_moved = pairs.graph.T_world_node.back() * T_moved_middle.inverse();
  }
  const Rigid3 T_fixed_middle = pairs.graph.T_world_node.back();
  double squared_errors = 0;
  for (const RelativePoseFactor& factor : pairs.graph.factors) {
    const double error = errorOf(factor, pairs.graph.T_world_node[factor.from], T_fixed_middle);
    if (error > kAgreeSigmas) continue;
    ++registration.pairs;
    squared_errors += error * error;
  }
  registration.checked = pairs.checked;
  const auto covariance =
      poseCovariance(PoseGraphOptions(), pairs.graph, pairs.graph.T_world_node.size() - 1);
  if (!covariance || 2 * registration.pairs < pairs.graph.factors.size()) {
    throw std::runtime_error("it cannot be registered: " + std::to_string(registration.pairs) +
                             " of " + std::to_string(pairs.graph.factors.size()) +
                             " pairs of keyframes agree: expected maps of one place");
  }
  registration.moved_m = (T_fixed_middle.translation - T_moved_middle.translation).norm();
  registration.moved_rad = T_fixed_middle.rotation.angularDistance(T_moved_middle.rotation);
  const double scale =
      std::sqrt(std::max(1., squared_errors / static_cast<double>(6 * registration.pairs)));
  registration.sigma_m =
      scale * std::sqrt(maxEigenvalue(Eigen::Matrix3d(covariance->topLeftCorner<3, 3>())));
  registration.sigma_rad =
      scale * std::sqrt(maxEigenvalue(Eigen::Matrix3d(covariance->bottomRightCorner<3, 3>())));
  return registration;
}

}  // namespace efm
