// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <ostream>
#include <vector>

#include "maps/cloud/cloud_point.h"

namespace efm {

/// A point as our files have it: x, y, z and intensity, as floats.
using PointRow = std::array<float, 4>;

/// @throws std::runtime_error naming the first point that a float cannot hold.
std::vector<PointRow> pointRows(const std::vector<CloudPoint>& points);

/// Four bytes, the lowest first.
void writeBinary(std::ostream& stream, float value);
/// A line for every point, with as few digits as read back to the same floats.
void writeText(std::ostream& stream, const std::vector<PointRow>& rows);

}  // namespace efm
