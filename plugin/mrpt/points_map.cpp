// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/points_map.h"

namespace efm {

mrpt::maps::CPointsMapXYZI::Ptr pointsMapOf(const std::vector<CloudPoint>& points) {
  auto map = mrpt::maps::CPointsMapXYZI::Create();
  map->resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f p_world = points[i].p_world.cast<float>();
    map->setPointFast(i, p_world.x(), p_world.y(), p_world.z());
    map->setPointIntensity(i, points[i].confidence);
  }
  map->mark_as_modified();
  return map;
}

}  // namespace efm
