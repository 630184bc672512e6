// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "maps/cloud/map_point.h"
#include "plugin/mrpt/mrpt_point_maps.h"

namespace efm {

/// The points as float32, as MRPT has points.
mrpt::maps::CPointsMapXYZI::Ptr pointsMapOf(const MapCloud& cloud);

}  // namespace efm
