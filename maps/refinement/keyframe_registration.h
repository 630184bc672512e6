// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/base/option.h"
#include "mapping/geometry/rigid3.h"
#include "maps/refinement/pose_refinement.h"
#include "maps/refinement/registration_points.h"

namespace efm {

struct KeyframeRegistrationOptions {
  /// The maximum distance between a point and its neighbour in the view of the neighbour, pixels.
  /// The first rounds use the uncertainty of the prior, limited by `first_distance_px`. The last
  /// rounds use `last_distance_px`. Range: above 0, the first at least the last.
  double first_distance_px = 16;
  double last_distance_px = 2;
  /// A gain below a thousandth ends a solve, because the neighbours change afterwards.
  AlignmentOptions alignment{3, 10, 1e-3};

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit(self.alignment);
    visit("first_distance_px", self.first_distance_px);
    visit("last_distance_px", self.last_distance_px,
          Allowed::above(0, 1e4, "above 0, at most 10000 (pixels)"));
  }
  void validate() const;
};

/// A keyframe of the local map.
struct MapKeyframe {
  std::size_t keyframe = 0;
  const RegistrationCloud* cloud = nullptr;  ///< Never null; not owned.
  Rigid3 T_world_ref;
};

/// The pose of a keyframe by its points.
struct Registration {
  Rigid3 T_world_ref;
  /// One factor per keyframe of the map that shares points: the pairs with this keyframe,
  /// linearised at the pose.
  std::vector<RelativePoseFactor> factors;
  std::size_t visible = 0;  ///< Points in the view of a keyframe of the map.
  std::size_t inliers = 0;  ///< Points with a neighbour in the last round.
  /// Median error of the pairs, in standard deviations. 0 without pairs.
  double median_error = 0;
  /// The distance of the pose from the prior, in standard deviations of the prior.
  double from_prior = 0;
  std::uint64_t failed_solves = 0;  ///< Failed solves: the pose stayed.

  /// Returns the fraction of the visible points that are inliers.
  double inlierRatio() const {
    return visible > 0 ? static_cast<double>(inliers) / static_cast<double>(visible) : 0;
  }
};

/// Registers a keyframe with the local map by generalised ICP (Segal, Haehnel and Thrun, RSS 2009).
/// Each round finds the neighbour of each point in each keyframe of the map, then the pose with the
/// minimum distance between all pairs of normal distributions. The maximum distance of neighbours
/// shrinks from round to round.
/// Each keyframe of the map has a tree in its own view. So neighbours stay valid when keyframes
/// move, and each factor connects two keyframes. Deterministic. With the default distances: six
/// rounds with 300 points, two with all points.
/// @param number of the keyframe, for the factors.
/// @param prior in the world, not singular. It determines unobservable directions.
/// @return a registration without inliers and factors if the last solve fails.
Registration registerKeyframe(std::size_t number, const RegistrationCloud& cloud,
                              const std::vector<MapKeyframe>& map, const PosePrior& prior,
                              const KeyframeRegistrationOptions& options);

}  // namespace efm
