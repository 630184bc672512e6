// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "maps/cloud/cloud_point.h"
#include "maps/metrics/sample_statistics.h"

namespace efm {

/// The distance from each point to the nearest of others, in metres and in the points' order.
/// Cost: a k-d tree over the others, a search for each point.
/// @param others at least one.
/// @throws std::invalid_argument where there is no other point, or one is not finite.
std::vector<double> nearestDistances(const std::vector<CloudPoint>& points,
                                     const std::vector<CloudPoint>& others);

/// How a map and the true surfaces, sampled as a cloud, differ. Its points can be no nearer to the
/// truth than the truth is dense.
struct CloudErrors {
  /// Accuracy: distances from the map's points to the truth, metres.
  SampleStatistics accuracy;
  /// The distance that 90 % of the map's points lie within (Seitz et al., CVPR 2006, "accuracy").
  double accuracy_p90_m = 0;
  /// Distances from the true points to the map, metres.
  SampleStatistics completeness_distance;
  double completeness_distance_p90_m =
      0;  ///< The distance that 90 % of the true points have the map within.

  /// One distance d that the two are held against.
  struct Step {
    double distance_m = 0;
    double within = 0;        ///< Share of the map's points at most d from the truth: precision.
    double outliers = 0;      ///< Share of the map's points farther than d from the truth.
    double completeness = 0;  ///< Share of the true points at most d from the map (Seitz et al.).
    double f1 = 0;            ///< Harmonic mean of `within` and `completeness` (Knapitsch et al.,
                              ///< SIGGRAPH 2017, "F-score"); 0 where both are.
  };
  std::vector<Step> steps;
};

/// Distances that suit rooms: 1 cm to 1 m.
std::vector<double> defaultCloudDistances();

/// @param distances_m above 0, in any order; kept in theirs.
/// @throws std::invalid_argument where a cloud is empty, a point is not finite or a distance is not
/// above 0.
CloudErrors cloudErrors(const std::vector<CloudPoint>& map, const std::vector<CloudPoint>& truth,
                        const std::vector<double>& distances_m);
/// The same with a truth of its own for completeness: `to_find`, what of the surfaces can be found.
CloudErrors cloudErrors(const std::vector<CloudPoint>& map, const std::vector<CloudPoint>& truth,
                        const std::vector<CloudPoint>& to_find,
                        const std::vector<double>& distances_m);

}  // namespace efm
