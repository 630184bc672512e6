// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/refinement/registration_points.h"

namespace efm::test {

/// A straight edge in the world, metres.
struct Edge {
  Eigen::Vector3d a = Eigen::Vector3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
};
using Edges = std::vector<Edge>;

inline ReferenceView smallView() { return {160, 120, 130, 130, 79.5, 59.5}; }

/// Draws edges of 0.5 to 1.5 m with any direction, 2 to 4 m from the y axis of the world.
inline Edges edgesAround(int count, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  Edges world;
  for (int i = 0; i < count; ++i) {
    const double angle = M_PI * uniform(random);
    const double away_m = 3 + uniform(random);
    const Eigen::Vector3d middle(away_m * std::sin(angle), 1.2 * uniform(random),
                                 away_m * std::cos(angle));
    const Eigen::Vector3d direction(uniform(random), uniform(random), uniform(random));
    const Eigen::Vector3d half = direction.normalized() * (0.5 + 0.25 * uniform(random));
    world.push_back({middle - half, middle + half});
  }
  return world;
}

/// Returns edges along x on one wall.
inline Edges stripes() {
  Edges world;
  for (int y = -4; y <= 4; ++y) world.push_back({{-9, 0.25 * y, 3}, {9, 0.25 * y, 3}});
  return world;
}

/// Returns a view along z, rotated by a yaw angle. The y axes of the world and the view point down.
inline Rigid3 viewTurned(double yaw_rad, const Eigen::Vector3d& p_world) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitY())), p_world};
}

/// Returns a keyframe without points.
inline KeyframeDepthMap emptyKeyframe(const ReferenceView& view) {
  KeyframeDepthMap keyframe;
  keyframe.view = view;
  keyframe.map.depth = cv::Mat1f(view.height, view.width, 0.0F);
  keyframe.map.confidence = cv::Mat1f(view.height, view.width, 0.0F);
  keyframe.map.variance = cv::Mat1f(view.height, view.width, 0.0F);
  return keyframe;
}

/// Returns the depth of the nearest edge in each pixel of a view. Inverse depths have a noise of
/// `sigma` (1/m); their stated variance is `sigma` squared.
inline KeyframeDepthMap seenFrom(const Edges& world, const Rigid3& T_world_ref, double sigma,
                                 std::mt19937& random) {
  KeyframeDepthMap keyframe = emptyKeyframe(smallView());
  keyframe.T_world_ref = T_world_ref;
  const Rigid3 T_ref_world = T_world_ref.inverse();
  for (const Edge& edge : world) {
    const int steps = static_cast<int>((edge.b - edge.a).norm() / 0.004);
    for (int i = 0; i <= steps; ++i) {
      const Eigen::Vector3d p_ref =
          T_ref_world * Eigen::Vector3d(edge.a + (edge.b - edge.a) * i / steps);
      if (p_ref.z() < 0.2) continue;
      const Eigen::Vector2d at = keyframe.view.project(p_ref);
      const cv::Point pixel(static_cast<int>(std::lround(at.x())),
                            static_cast<int>(std::lround(at.y())));
      if (!cv::Rect({0, 0}, keyframe.map.depth.size()).contains(pixel)) continue;
      float& depth = keyframe.map.depth(pixel);
      if (depth == 0 || p_ref.z() < depth) depth = static_cast<float>(p_ref.z());
    }
  }
  std::normal_distribution<double> error(0, sigma);
  for (auto depth = keyframe.map.depth.begin(); depth != keyframe.map.depth.end(); ++depth) {
    if (*depth == 0) continue;
    *depth = static_cast<float>(1 / std::max(0.05, 1 / *depth + error(random)));
    keyframe.map.variance(depth.pos()) = static_cast<float>(sigma * sigma);
    keyframe.map.confidence(depth.pos()) = 1;
  }
  return keyframe;
}

/// The error of a good keyframe: 1 cm at a depth of 2 m, 4 cm at 4 m.
constexpr double kInverseDepthSigma = 0.0025;  // 1/m

/// Keeps only the first `count` depths of a keyframe.
inline void keepFirst(int count, KeyframeDepthMap& keyframe) {
  for (float& depth : keyframe.map.depth) {
    if (depth > 0 && count-- <= 0) depth = 0;
  }
}

inline RegistrationCloud cloudFrom(const Edges& world, const Rigid3& T_world_ref,
                                   std::mt19937& random) {
  return {seenFrom(world, T_world_ref, kInverseDepthSigma, random), {}};
}

}  // namespace efm::test
