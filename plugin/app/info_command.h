// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "plugin/app/progress.h"
#include "plugin/app/recording_interval.h"
#include "plugin/recordings/open/open_recording.h"

namespace efm {

struct InfoArguments {
  RecordingSource source;
  TimeArguments times;
  bool strict = false;  ///< A warning is an error.
  bool system = false;  ///< Also print the processor and its kernels; then no recording is needed.
  Verbosity verbosity = Verbosity::kNormal;
};

/// `event-fusion info`: prints the contents of a recording; if quiet, only what is wrong with
/// it.
/// @return the process's exit status.
/// @throws std::exception if the recording cannot be read to its end. The contents before the error
/// have been printed.
int runInfo(const InfoArguments& arguments);

}  // namespace efm
