// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/points_map.h"

namespace efm {

mrpt::maps::CPointsMapXYZI::Ptr pointsMapOf(const MapCloud& cloud) {
  auto map = mrpt::maps::CPointsMapXYZI::Create();
  map->resize(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3f p_world = positionIn(cloud, cloud[i]).cast<float>();
    map->setPointFast(i, p_world.x(), p_world.y(), p_world.z());
    map->setPointIntensity(i, cloud[i].intensity);
  }
  map->mark_as_modified();
  return map;
}

}  // namespace efm
