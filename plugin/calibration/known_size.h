// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "mapping/geometry/camera.h"
#include "plugin/calibration/calibration_file.h"

namespace efm {

/// The size of a sensor whose size nobody knows: events have no pixel beyond it.
inline constexpr CameraSize kUnknownSize = {65'535, 65'535};

/// The size of a camera, where it is known.
inline std::optional<CameraSize> knownSize(const CameraModel& model) {
  if (model.width == kUnknownSize.width && model.height == kUnknownSize.height) return std::nullopt;
  return CameraSize{model.width, model.height};
}

}  // namespace efm
