// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/output/map_measures.h"

#include <algorithm>

#include "maps/metrics/sample_statistics.h"

namespace efm {

std::optional<MapExtent> extentOf(const MapCloud& cloud, double outside) {
  if (cloud.empty()) return std::nullopt;
  MapExtent extent;
  const auto last = static_cast<std::ptrdiff_t>(cloud.size() - 1);
  const auto cut = static_cast<std::ptrdiff_t>(outside * static_cast<double>(last));
  std::vector<float> values(cloud.size());
  for (int axis = 0; axis < 3; ++axis) {
    const auto valueAt = [&](std::ptrdiff_t index) {
      std::nth_element(values.begin(), values.begin() + index, values.end());
      return static_cast<double>(cloud.sensor_origin_[axis]) +
             static_cast<double>(values[static_cast<std::size_t>(index)]);
    };
    std::transform(cloud.begin(), cloud.end(), values.begin(),
                   [&](const MapPoint& point) { return point.data[axis]; });
    extent.min_m[axis] = valueAt(cut);
    extent.max_m[axis] = valueAt(last - cut);
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
