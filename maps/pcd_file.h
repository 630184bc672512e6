// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ostream>
#include <vector>

#include "maps/point_cloud_file.h"

namespace efm {

/// PCL's file format, version 0.7. Written here, because PCL's writers do not
/// see that a disk is full. PCL's own LZF is what compresses.

/// @throws std::runtime_error where a float cannot hold a point, or a compressed file so many.
void writePcdTo(std::ostream& stream, const std::vector<CloudPoint>& points,
                PointCloudEncoding encoding);

}  // namespace efm
