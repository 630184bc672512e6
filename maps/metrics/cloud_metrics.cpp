// SPDX-License-Identifier: BSD-3-Clause
#include "maps/metrics/cloud_metrics.h"

#include <algorithm>
#include <stdexcept>

#include "mapping/base/option.h"

namespace efm {
namespace {

double fractionWithin(const std::vector<double>& distances, double limit_m) {
  const auto count = std::count_if(distances.begin(), distances.end(),
                                   [&](double distance) { return distance <= limit_m; });
  return static_cast<double>(count) / static_cast<double>(distances.size());
}

}  // namespace

std::vector<double> nearestDistances(const std::vector<CloudPoint>& points,
                                     const std::vector<CloudPoint>& others) {
  if (others.empty()) throw std::invalid_argument("no point to measure distances to");
  const Eigen::Vector3d origin = medianPosition(others);
  const PointTree tree(offsetsFrom(origin, others));
  const std::vector<Eigen::Vector3f> queries = offsetsFrom(origin, points);
  std::vector<double> distances;
  distances.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    // In double: the distance of the search is a float.
    const CloudPoint& other = others[tree.nearest(queries[i]).index];
    distances.push_back((points[i].p_world - other.p_world).norm());
  }
  return distances;
}

std::vector<double> defaultCloudDistances() {
  return {0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 1};
}

CloudErrors cloudErrors(const std::vector<CloudPoint>& map, const std::vector<CloudPoint>& truth,
                        const std::vector<double>& distances_m) {
  return cloudErrors(map, truth, truth, distances_m);
}

CloudErrors cloudErrors(const std::vector<CloudPoint>& map, const std::vector<CloudPoint>& truth,
                        const std::vector<CloudPoint>& to_find,
                        const std::vector<double>& distances_m) {
  if (map.empty()) throw std::invalid_argument("the map has no points");
  if (truth.empty() || to_find.empty()) throw std::invalid_argument("the truth has no points");
  for (const double distance_m : distances_m) {
    requireOption(distance_m > 0, "distance", distance_m, "above 0 (metres)");
  }
  const std::vector<double> to_truth = nearestDistances(map, truth);
  const std::vector<double> to_map = nearestDistances(to_find, map);

  CloudErrors errors;
  errors.accuracy = statisticsOf(to_truth);
  errors.accuracy_p90_m = quantileOf(to_truth, 0.9);
  errors.completeness_distance = statisticsOf(to_map);
  errors.completeness_distance_p90_m = quantileOf(to_map, 0.9);
  for (const double distance_m : distances_m) {
    CloudErrors::Step step;
    step.distance_m = distance_m;
    step.within = fractionWithin(to_truth, distance_m);
    step.outliers = 1 - step.within;
    step.completeness = fractionWithin(to_map, distance_m);
    const double sum = step.within + step.completeness;
    step.f1 = sum > 0 ? 2 * step.within * step.completeness / sum : 0;
    errors.steps.push_back(step);
  }
  return errors;
}

}  // namespace efm
