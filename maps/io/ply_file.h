// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ostream>
#include <string_view>
#include <vector>

#include "maps/io/point_cloud_file.h"

namespace efm {

/// The Stanford polygon format, version 1.0: the element `vertex` is the cloud. Written and read
/// here, because PCL's reader leaves coordinates of type double at 0, takes a word for a number and
/// prints; and its writer writes nothing for no points, rounds text to 8 digits and does not see
/// that a disk is full.

/// @param encoding binary or ASCII.
/// @throws std::runtime_error where it is another or a float cannot hold a point.
void writePlyTo(std::ostream& stream, const std::vector<CloudPoint>& points,
                PointCloudEncoding encoding);

/// @throws std::runtime_error naming the line or byte, the value and what was expected.
PointCloudContent parsePly(std::string_view bytes);

}  // namespace efm
