// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "maps/cloud/cloud_points.h"
#include "maps/metrics/sample_statistics.h"

namespace efm {

/// Returns the distance of each point to the nearest of the other points, metres, in the order of
/// `points`. Cost: a k-d tree over the other points, and a search per point.
std::vector<double> nearestDistances(const std::vector<CloudPoint>& points,
                                     const std::vector<CloudPoint>& others);

/// The errors of a map against the true surfaces, sampled as a cloud. The spacing of the true
/// points limits the accuracy that can be measured.
struct CloudErrors {
  /// Distances from the points of the map to the truth, metres.
  SampleStatistics accuracy;
  /// 90 % of the points of the map are within this distance (Seitz et al., CVPR 2006, "accuracy").
  double accuracy_p90_m = 0;
  /// Distances from the true points to the map, metres.
  SampleStatistics completeness_distance;
  double completeness_distance_p90_m = 0;  ///< 90 % of the true points are within this distance.

  /// The results at one distance d.
  struct Step {
    double distance_m = 0;
    double within = 0;        ///< Fraction of the map at most d from the truth: precision.
    double outliers = 0;      ///< Fraction of the map farther than d from the truth.
    double completeness = 0;  ///< Fraction of the truth at most d from the map (Seitz et al.).
    double f1 = 0;            ///< Harmonic mean of `within` and `completeness` (Knapitsch et al.,
                              ///< SIGGRAPH 2017, "F-score"); 0 if both are 0.
  };
  std::vector<Step> steps;
};

/// Returns distances from 1 cm to 1 m, for rooms.
std::vector<double> defaultCloudDistances();

/// Measures a map. @param distances_m above 0, in any order; the steps have the same order.
CloudErrors cloudErrors(const std::vector<CloudPoint>& map, const std::vector<CloudPoint>& truth,
                        const std::vector<double>& distances_m);
/// Measures a map with another truth for completeness: `to_find`, the part of the surfaces that the
/// method can find.
CloudErrors cloudErrors(const std::vector<CloudPoint>& map, const std::vector<CloudPoint>& truth,
                        const std::vector<CloudPoint>& to_find,
                        const std::vector<double>& distances_m);

}  // namespace efm
