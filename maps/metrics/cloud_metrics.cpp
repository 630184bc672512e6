// SPDX-License-Identifier: BSD-3-Clause
#include "maps/metrics/cloud_metrics.h"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <stdexcept>

#include "mapping/options/option_check.h"
#include "maps/cloud/pcl_cloud.h"

namespace efm {
namespace {

double shareWithin(const std::vector<double>& distances, double limit_m) {
  const auto count = std::count_if(distances.begin(), distances.end(),
                                   [&](double distance) { return distance <= limit_m; });
  return static_cast<double>(count) / static_cast<double>(distances.size());
}

}  // namespace

std::vector<double> nearestDistances(const std::vector<CloudPoint>& points,
                                     const std::vector<CloudPoint>& others) {
  if (others.empty()) throw std::invalid_argument("no point to measure distances to");
  const Eigen::Vector3d middle = medianPosition(others);
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  tree.setInputCloud(pclCloudAround(middle, others));

  std::vector<double> distances;
  distances.reserve(points.size());
  pcl::Indices nearest(1);
  std::vector<float> squared(1);
  const auto queries = pclCloudAround(middle, points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    tree.nearestKSearch((*queries)[i], 1, nearest, squared);
    // The search's own distance is a float's.
    const CloudPoint& other = others[static_cast<std::size_t>(nearest[0])];
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
    step.within = shareWithin(to_truth, distance_m);
    step.outliers = 1 - step.within;
    step.completeness = shareWithin(to_map, distance_m);
    const double sum = step.within + step.completeness;
    step.f1 = sum > 0 ? 2 * step.within * step.completeness / sum : 0;
    errors.steps.push_back(step);
  }
  return errors;
}

}  // namespace efm
