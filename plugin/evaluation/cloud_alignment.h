// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "maps/cloud/cloud_points.h"

namespace efm {

/// A map aligned with the truth.
struct CloudAlignment {
  Rigid3 T_truth_map;           ///< From the map's frame to the truth's.
  std::size_t points = 0;       ///< Of the map that were compared with the truth.
  std::size_t points_used = 0;  ///< Of these, the ones near enough in the last round.
};

/// Finds the rigid transform that brings a map onto the true surfaces, with PCL's ICP: distances
/// along the truth's normals (Chen and Medioni, Image and Vision Computing 1992). Starts from the
/// identity. In each round it uses the points whose distance is within three times the median. Of a
/// large map, every n-th point is compared, 20,000 at least.
/// @throws std::runtime_error saying what was expected: where a cloud has too few points, where the
/// surfaces do not determine all six coordinates (a single wall), or where ICP does not converge.
CloudAlignment alignCloud(const std::vector<CloudPoint>& map, const std::vector<CloudPoint>& truth);

}  // namespace efm
