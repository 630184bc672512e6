// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "maps/cloud/cloud_point.h"

namespace efm {

/// Where a point is, for messages: "point (1, 2.5, -3)", with all digits.
std::string pointText(const CloudPoint& point);

}  // namespace efm
