// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "mapping/keyframes/keyframe_depth_map.h"

namespace efm {

struct RegistrationCloudOptions {
  /// Points that are registered with other keyframes': the most certain, spread over the image.
  /// Range: 10 to 100,000.
  int max_points = 2000;
  /// Points that other keyframes' are registered with, chosen alike: a neighbour that is left out
  /// is taken for another one. Range: `max_points` to 1,000,000.
  int max_map_points = 6000;
  /// What an edge's place in the image errs by, pixels. Range: above 0, at most 100.
  double pixel_sigma = 0.5;
  /// How many times its own standard deviation a depth counts with. Depths of an edge err together,
  /// so that they do not average out as places in the image do: on the simulated room the errors
  /// of a registration halve from 1 to 4 and stay the same from there to 16. Range: 1 to 1000.
  double depth_sigmas = 6;
  /// Half the side, in pixels, of the neighbourhood whose shape a point stands for. Range: 1 to 20.
  int neighbourhood_px = 3;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// A point of a keyframe as a normal distribution: where the edge or surface that it is part of may
/// be. The covariance is that of the points around it, which lie along an edge or on a surface,
/// plus that of its own measurement: so an edge holds two directions, a surface one.
struct RegistrationPoint {
  Eigen::Vector3f p_ref = Eigen::Vector3f::Zero();           ///< Metres, frame `ref`.
  Eigen::Matrix3f covariance = Eigen::Matrix3f::Identity();  ///< m^2, frame `ref`.
};

/// A keyframe's points, for registering keyframes with each other. Floats: 48 bytes a point, and as
/// many for the tree while there is one.
class RegistrationCloud {
 public:
  /// @throws std::invalid_argument where the options are not valid.
  RegistrationCloud(const KeyframeDepthMap& keyframe, const RegistrationCloudOptions& options);
  ~RegistrationCloud();
  RegistrationCloud(RegistrationCloud&&) noexcept;
  RegistrationCloud& operator=(RegistrationCloud&&) noexcept;

  /// Those that others are registered with; the first `numQueryPoints` are registered with others.
  const std::vector<RegistrationPoint>& points() const { return points_; }
  std::size_t numQueryPoints() const { return num_chosen_; }
  /// Focal length in pixels, and the middle of the inverse depths, 1/m.
  double focalPx() const { return view_.fx; }
  double middleInverseDepth() const { return 0.5 * (nearest_ + farthest_); }

  /// Whether a point lies in the view, between its nearest and its farthest point or about there.
  bool sees(const Eigen::Vector3d& p_ref) const;
  /// The point that looks nearest from the keyframe's view: by column, row, and inverse depth in
  /// units of its typical standard deviation; there errors are alike in all directions and at all
  /// depths, which they are not in space.
  /// @return its index, or nothing where none is as near as that.
  std::optional<std::size_t> nearest(const Eigen::Vector3d& p_ref, double max_distance_px) const;

  /// The first search makes the tree; this gives its memory back. Not thread-safe either.
  void releaseTree() const;

 private:
  struct Tree;
  Eigen::Vector3f seenAt(const Eigen::Vector3d& p_ref) const;
  void makeTree() const;

  ReferenceView view_;
  std::vector<RegistrationPoint> points_;
  std::size_t num_chosen_ = 0;
  double px_per_inverse_depth_ = 1;
  double nearest_ = 0;   // inverse depth, 1/m
  double farthest_ = 0;  // inverse depth, 1/m
  mutable std::unique_ptr<Tree> tree_;
};

}  // namespace efm
