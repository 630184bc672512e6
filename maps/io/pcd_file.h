// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ostream>
#include <string_view>
#include <vector>

#include "maps/io/point_cloud_file.h"

namespace efm {

/// Writes a binary PCD file, version 0.7.
/// @throws std::runtime_error naming a point that is not finite.
void writePcdTo(std::ostream& stream, const MapCloud& cloud);

/// @throws std::runtime_error naming the line or byte, the value and the expected one.
PointCloudContent parsePcd(std::string_view bytes);

}  // namespace efm
