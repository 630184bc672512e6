// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "maps/cloud_point.h"

namespace efm {

/// Writes a binary PCD file with the fields x y z intensity (intensity = confidence), all float32.
/// Appears under its name only when it is complete.
/// @throws std::runtime_error naming the path where it cannot be written.
void writePcd(const std::filesystem::path& path, const std::vector<CloudPoint>& points);

}  // namespace efm
