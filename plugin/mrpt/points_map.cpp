// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/points_map.h"

#include <fmt/format.h>

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

std::optional<std::string> roundingWarning(const MapCloud& cloud, double voxel_size_m) {
  const auto step_m = coarseStepOf(cloud, voxel_size_m);
  if (!step_m) return std::nullopt;
  return fmt::format(
      "MRPT's maps have float points, whose steps at the map's coordinates are {:.2g} m, over a "
      "tenth of a voxel of {:g} m: let poses begin nearer to the origin of the world",
      *step_m, voxel_size_m);
}

}  // namespace efm
