// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

#include "maps/io/point_cloud_file.h"

namespace efm {

/// Parses the Stanford polygon format, version 1.0. The element `vertex` is the cloud.
/// @throws std::runtime_error naming the line or byte, the value and the expected one.
PointCloudContent parsePly(std::string_view bytes);

}  // namespace efm
