// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "plugin/app/progress.h"
#include "plugin/app/recording_interval.h"
#include "plugin/recordings/open/open_recording.h"

namespace efm {

struct ExportArguments {
  RecordingSource source;
  TimeArguments times;
  std::string format;  ///< One of `exportFormats`.
  std::filesystem::path out;
  Verbosity verbosity = Verbosity::kNormal;
};

/// The formats that this build writes.
std::vector<std::string> exportFormats();

/// `event-fusion export`: writes a recording for other tools. Stamps have the cameras' time offsets
/// added; poses are those of camera 0, T_world_cam0.
/// @return the process's exit status.
/// @throws Interrupted if a signal came; then there is no result.
/// A recording without poses or calibration will do. Of a damaged one, what came before the damage
/// is written, and the status is 1.
/// @throws std::exception if no event can be read or the result cannot be written. Then there is no
/// result.
int runExport(const ExportArguments& arguments);

}  // namespace efm
