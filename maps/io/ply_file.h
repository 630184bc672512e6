// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ostream>
#include <string_view>
#include <vector>

#include "maps/io/point_cloud_file.h"

namespace efm {

/// Writes a binary little-endian file of the Stanford polygon format, version 1.0, for viewers. Per
/// vertex: x, y, z (double: maps may lie far from the origin), red, green, blue (uchar), confidence
/// (float) and support (uint).
/// @param colours one per point.
/// @throws std::runtime_error naming a point that is not finite.
void writePlyTo(std::ostream& stream, const MapCloud& cloud,
                const std::vector<PointColour>& colours);

/// Parses the Stanford polygon format, version 1.0. The element `vertex` is the cloud.
/// @throws std::runtime_error naming the line or byte, the value and the expected one.
PointCloudContent parsePly(std::string_view bytes);

}  // namespace efm
