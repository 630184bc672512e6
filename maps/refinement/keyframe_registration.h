// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "maps/refinement/pose_difference.h"
#include "maps/refinement/pose_refinement.h"
#include "maps/refinement/registration_cloud.h"

namespace efm {

struct KeyframeRegistrationOptions {
  /// How far a point and its neighbour may be from each other in the neighbour's view, pixels: at
  /// first as far as the prior is uncertain, but no farther than the first number; in the end the
  /// last one. Range: above 0, the first not below the last.
  double first_distance_px = 16;
  double last_distance_px = 2;
  /// Neighbours change after it anyway: exactness beyond a share of a thousandth is no use.
  AlignmentOptions alignment{3, 10, 1e-3};

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// A keyframe of the local map: its points, and where it stands by now.
struct MapKeyframe {
  std::size_t keyframe = 0;
  const RegistrationCloud* cloud = nullptr;  ///< Never null; not owned.
  Rigid3 T_world_ref;
};

/// Where a keyframe stands by its points.
struct Registration {
  Rigid3 T_world_ref;
  /// What the pairs with each keyframe of the map say, around that pose; `to` is the keyframe. One
  /// for each that shares points with it.
  std::vector<RelativePoseFactor> factors;
  std::size_t seen = 0;     ///< Points that some keyframe of the map should have seen.
  std::size_t inliers = 0;  ///< Those that have a neighbour at the end.
  /// Of the pairs, in standard deviations. 0 without any.
  double median_error = 0;
  /// How far the pose is from the prior, in standard deviations of the latter.
  double from_prior = 0;

  /// Share of the points that should have been seen and were.
  double inlierRatio() const;
};

/// Registers a keyframe with the local map: finds each point's neighbour in each of the map's
/// keyframes and the pose where the distances between all of these distributions are least
/// (generalised ICP: Segal, Haehnel and Thrun, RSS 2009), again and again with nearer neighbours.
/// Each keyframe of the map has a tree of its own, in its own view: so neighbours stay right when
/// keyframes move, and what is found holds two keyframes together, not one and a map that moves.
/// Deterministic. Bounded: six rounds with 300 points for the default distances, two with all.
/// @param number the keyframe's, for the factors.
/// @param prior in the world; what the map says nothing of stays with it. Not singular.
Registration registerKeyframe(std::size_t number, const RegistrationCloud& cloud,
                              const std::vector<MapKeyframe>& map, const PosePrior& prior,
                              const KeyframeRegistrationOptions& options);

}  // namespace efm
