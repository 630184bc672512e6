// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "mapping/base/text.h"
#include "plugin/session/recording_statistics.h"

namespace efm {

/// What is implausible about the motion of the poses beside the events: poses that repeat
/// (`poses-frozen`), steps that the tracker otherwise does not make (`pose-jump`), and motion that
/// is interpolated over more than 0.1 s (`pose-interpolation`). A part of `healthWarnings`.
/// Nothing without poses, events or a calibrated camera.
/// @param depth_m at which motion is seen: a middle one of the scene.
/// @param max_pose_gap_s events in longer gaps are not used.
std::vector<Warning> motionWarnings(const RecordingStatistics& recording, double depth_m,
                                    double max_pose_gap_s);

}  // namespace efm
