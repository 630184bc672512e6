// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ostream>
#include <string_view>
#include <vector>

#include "maps/io/point_cloud_file.h"

namespace efm {

/// PCL's file format, version 0.7. Written and read here, because PCL's reader takes a word for a
/// number and a short line for a point, prints, and crashes on a header without end; and its
/// writers do not see that a disk is full. PCL's own LZF is what compresses.

/// @throws std::runtime_error where a float cannot hold a point, or a compressed file so many.
void writePcdTo(std::ostream& stream, const std::vector<CloudPoint>& points,
                PointCloudEncoding encoding);

/// @throws std::runtime_error naming the line or byte, the value and what was expected.
PointCloudContent parsePcd(std::string_view bytes);

}  // namespace efm
