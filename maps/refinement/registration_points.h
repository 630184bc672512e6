// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mapping/keyframes/keyframe_depth_map.h"

namespace efm {

struct RegistrationCloudOptions {
  /// Maximum number of points that are registered with other keyframes: the most certain ones,
  /// spread over the image. Range: 10 to 100,000.
  int max_points = 2000;
  /// Maximum number of points that other keyframes are registered with, selected in the same way.
  /// More points, because a missing neighbour causes a wrong pair. Range: `max_points` to
  /// 1,000,000.
  int max_map_points = 6000;
  /// Standard deviation of the position of an edge in the image, pixels. Range: above 0, at most
  /// 100.
  double pixel_sigma = 0.5;
  /// Factor of the standard deviation of depths. The depths of an edge have common errors, which do
  /// not average out. In the simulated room the errors of a registration halve from 1 to 4 and stay
  /// the same up to 16. Range: 1 to 1000.
  double depth_sigmas = 6;
  /// Half the side of the neighbourhood whose shape a point represents, pixels. Range: 1 to 20.
  int neighbourhood_px = 3;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// A point of a keyframe as a normal distribution. Its covariance is that of the points around it,
/// which lie along an edge or on a surface, plus that of its own measurement. So an edge determines
/// two directions, and a surface one.
struct RegistrationPoint {
  Eigen::Vector3f p_ref = Eigen::Vector3f::Zero();           ///< Metres, frame `ref`.
  Eigen::Matrix3f covariance = Eigen::Matrix3f::Identity();  ///< m^2, frame `ref`.
};

/// The points of a keyframe for registrations, the most certain ones first.
struct RegistrationPoints {
  std::vector<RegistrationPoint> points;
  double max_inverse_depth = 0;          ///< 1/m.
  double min_inverse_depth = 0;          ///< 1/m.
  float median_inverse_depth_sigma = 0;  ///< 1/m. 0 without points.
};

/// Selects the most certain points of each cell of the image, and computes their covariances.
/// @throws std::invalid_argument where the options are not valid.
RegistrationPoints selectPoints(const KeyframeDepthMap& keyframe,
                                const RegistrationCloudOptions& options);

}  // namespace efm
