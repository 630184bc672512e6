// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/output/map_measures.h"

#include <algorithm>

#include "maps/metrics/sample_statistics.h"

namespace efm {

std::optional<MapExtent> extentOf(const MapCloud& cloud) {
  if (cloud.empty()) return std::nullopt;
  const Eigen::Vector3d first = positionIn(cloud, cloud.front());
  MapExtent extent{first, first};
  for (const MapPoint& point : cloud) {
    const Eigen::Vector3d p_world = positionIn(cloud, point);
    extent.min_m = extent.min_m.cwiseMin(p_world);
    extent.max_m = extent.max_m.cwiseMax(p_world);
  }
  return extent;
}

PoseShift shiftBetween(const std::vector<StampedPose>& before,
                       const std::vector<StampedPose>& after) {
  std::vector<double> distances_m;
  std::vector<double> angles_rad;
  for (std::size_t i = 0; i < std::min(before.size(), after.size()); ++i) {
    const Rigid3& a = before[i].T_world_rig;
    const Rigid3& b = after[i].T_world_rig;
    distances_m.push_back((b.translation - a.translation).norm());
    angles_rad.push_back(a.rotation.angularDistance(b.rotation));
  }
  const SampleStatistics distance = statisticsOf(distances_m);
  const SampleStatistics angle = statisticsOf(angles_rad);
  return {distance.median, distance.max, angle.median, angle.max};
}

}  // namespace efm
