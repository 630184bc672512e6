// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "mapping/base/option.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/cloud/cloud_points.h"

namespace efm {

struct RegistrationCloudOptions {
  /// Maximum number of points that are registered with other keyframes: the most certain points,
  /// spread over the image. Range: 10 to 100,000.
  int max_points = 2000;
  /// Maximum number of points that other keyframes are registered with, selected in the same way.
  /// There are more, because a missing neighbour causes a wrong pair. Range: `max_points` to
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

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("max_points", self.max_points, Allowed::from(10, 100'000, "from 10 to 100000"));
    visit("max_map_points", self.max_map_points);
    visit("pixel_sigma", self.pixel_sigma,
          Allowed::above(0, 100, "above 0, at most 100 (pixels)").notInFiles());
    visit("depth_sigmas", self.depth_sigmas, Allowed::from(1, 1000, "from 1 to 1000").notInFiles());
    visit("neighbourhood_px", self.neighbourhood_px,
          Allowed::from(1, 20, "from 1 to 20 (pixels)").notInFiles());
  }
  void validate() const;
};

/// A point of a keyframe as a normal distribution. Its covariance is the covariance of the points
/// around it, which lie along an edge or on a surface, plus that of its own measurement. So an edge
/// determines two directions, and a surface one.
struct RegistrationPoint {
  Eigen::Vector3f p_ref = Eigen::Vector3f::Zero();           ///< Metres, frame `ref`.
  Eigen::Matrix3f covariance = Eigen::Matrix3f::Identity();  ///< m^2, frame `ref`.
};

/// The points of a keyframe for registrations. 48 bytes per point, and as much for the search tree.
class RegistrationCloud {
 public:
  /// Selects the most certain points of each cell of the image, and computes their covariances.
  RegistrationCloud(const KeyframeDepthMap& keyframe, const RegistrationCloudOptions& options);

  /// The most certain points first. Other keyframes are registered with all of them. Only the first
  /// `numQueryPoints` are registered with other keyframes.
  const std::vector<RegistrationPoint>& points() const { return points_; }
  std::size_t numQueryPoints() const { return num_query_points_; }
  /// The focal length in pixels, and the middle of the range of inverse depths, 1/m.
  double focalPx() const { return view_.fx; }
  double middleInverseDepth() const { return 0.5 * (max_inverse_depth_ + min_inverse_depth_); }

  /// Returns whether a point lies in the view, and in its range of depths (with a margin).
  bool isInView(const Eigen::Vector3d& p_ref) const;
  /// Returns the index of the nearest point in the view: by column, row, and inverse depth in units
  /// of its median standard deviation. In these coordinates errors are equal in all directions and
  /// at all depths; in space they are not.
  /// @return std::nullopt if no point is within the distance.
  std::optional<std::size_t> nearest(const Eigen::Vector3d& p_ref, double max_distance_px) const;

  /// Drops all points: nothing is in view, and nothing is found.
  void clear() noexcept;
  /// Frees the search tree. The next search builds it again. Neither is thread-safe.
  void releaseTree() const { tree_.reset(); }

 private:
  Eigen::Vector3f viewCoordinates(const Eigen::Vector3d& p_ref) const;

  ReferenceView view_;
  std::vector<RegistrationPoint> points_;
  std::size_t num_query_points_ = 0;
  double px_per_inverse_depth_ = 1;
  double max_inverse_depth_ = 0;  // 1/m
  double min_inverse_depth_ = 0;  // 1/m
  mutable std::unique_ptr<PointTree> tree_;
};

}  // namespace efm
