// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "mapping/base/text.h"
#include "plugin/session/recording_statistics.h"

namespace efm {

/// What is implausible about the cameras: their calibration, and their events. A part of
/// `healthWarnings`.
std::vector<Warning> cameraWarnings(const RecordingStatistics& recording);

}  // namespace efm
