// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "maps/cloud/map_point.h"
#include "plugin/mrpt/mrpt_point_maps.h"

namespace efm {

/// The points as float32 in the world, as MRPT has points.
mrpt::maps::CPointsMapXYZI::Ptr pointsMapOf(const MapCloud& cloud);

/// A warning where this rounds them by more than a tenth of a voxel.
std::optional<std::string> roundingWarning(const MapCloud& cloud, double voxel_size_m);

}  // namespace efm
