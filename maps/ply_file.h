// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ostream>
#include <vector>

#include "maps/point_cloud_file.h"

namespace efm {

/// The Stanford polygon format, version 1.0: the element `vertex` is the cloud. Written
/// here, because PCL's writer writes nothing for no points, rounds text to 8 digits and does not
/// see that a disk is full.

/// @param encoding binary or ASCII.
/// @throws std::runtime_error where it is another or a float cannot hold a point.
void writePlyTo(std::ostream& stream, const std::vector<CloudPoint>& points,
                PointCloudEncoding encoding);

}  // namespace efm
