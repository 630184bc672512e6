// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "maps/cloud/map_point.h"
#include "maps/io/point_cloud_file.h"

namespace efm {

/// The colours of points by their height: plasma, from dark (low) to bright (high), whose lightness
/// changes evenly. The lowest and the highest hundredth of the points, where outliers are, do not
/// widen its range.
/// @param upward a unit vector, frame `world`.
std::vector<PointColour> coloursByHeight(const MapCloud& cloud, const Eigen::Vector3d& upward);

}  // namespace efm
