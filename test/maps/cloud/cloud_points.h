// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <vector>

#include "maps/cloud/map_point.h"

namespace efm::test {

inline bool sameBits(const MapCloud& a, const MapCloud& b) {
  return a.sensor_origin_ == b.sensor_origin_ &&
         std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const MapPoint& p, const MapPoint& q) {
                      // The bytes after the last member are padding.
                      constexpr std::size_t kBytes =
                          offsetof(MapPoint, first_keyframe) + sizeof(p.first_keyframe);
                      return std::memcmp(&p, &q, kBytes) == 0;
                    });
}

/// Returns the points of a cloud in the world.
inline std::vector<CloudPoint> worldPoints(const MapCloud& cloud) {
  std::vector<CloudPoint> points;
  for (const MapPoint& point : cloud) {
    points.push_back({positionIn(cloud, point), point.intensity, point.support,
                      point.first_keyframe, point.sigma, point.probability});
  }
  return points;
}

}  // namespace efm::test
