// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/maps/CPointsMapXYZI.h>

#include <vector>

#include "maps/cloud/cloud_point.h"

namespace efm {

/// The points as float32, as MRPT has points.
mrpt::maps::CPointsMapXYZI::Ptr pointsMapOf(const std::vector<CloudPoint>& points);

}  // namespace efm
