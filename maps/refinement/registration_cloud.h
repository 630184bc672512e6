// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "mapping/keyframes/keyframe_depth_map.h"
#include "maps/cloud/point_search.h"
#include "maps/refinement/registration_points.h"

namespace efm {

/// The points of a keyframe for registrations. 48 bytes a point, and as much for the search tree.
class RegistrationCloud {
 public:
  /// @throws std::invalid_argument where the options are not valid.
  RegistrationCloud(const KeyframeDepthMap& keyframe, const RegistrationCloudOptions& options);

  /// Other keyframes are registered with all points. The first `numQueryPoints` are registered with
  /// other keyframes.
  const std::vector<RegistrationPoint>& points() const { return points_; }
  std::size_t numQueryPoints() const { return num_query_points_; }
  /// The focal length in pixels, and the middle of the range of inverse depths, 1/m.
  double focalPx() const { return view_.fx; }
  double middleInverseDepth() const { return 0.5 * (max_inverse_depth_ + min_inverse_depth_); }

  /// Whether a point lies in the view, and in its range of depths (with a margin).
  bool isInView(const Eigen::Vector3d& p_ref) const;
  /// The index of the nearest point in the view: by column, row, and inverse depth in units of its
  /// median standard deviation. In these coordinates errors are equal in all directions and at all
  /// depths; in space they are not.
  /// @return nothing where no point is within the distance.
  std::optional<std::size_t> nearest(const Eigen::Vector3d& p_ref, double max_distance_px) const;

  /// Drops all points: nothing is in view, and nothing is found.
  void clear() noexcept;
  /// Frees the search tree. The next search builds it again. Neither is thread-safe.
  void releaseTree() const;

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
