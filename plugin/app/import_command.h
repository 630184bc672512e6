// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "plugin/app/progress.h"
#include "plugin/app/recording_interval.h"
#include "plugin/recordings/open/open_recording.h"
#include "plugin/recordings/open/rawlog.h"

namespace efm {

struct ImportArguments {
  RecordingSource source;
  TimeArguments times;
  std::filesystem::path out;
  RawlogCompression compression = RawlogCompression::kGzip;
  Verbosity verbosity = Verbosity::kNormal;
};

/// `event-fusion import`: writes a recording as a rawlog. Replaces an earlier rawlog, no other
/// file.
/// @return the process's exit status.
/// @throws Interrupted if a signal came; then there is no result.
/// A recording without poses or calibration will do. Of a damaged one, what came before the damage
/// is written, and the status is 1.
/// @throws std::exception if no event can be read or the rawlog cannot be written. Then there is no
/// rawlog.
int runImport(const ImportArguments& arguments);

}  // namespace efm
