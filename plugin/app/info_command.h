// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "plugin/formats/open_recording.h"

namespace efm {

struct InfoArguments {
  RecordingSource source;
  std::optional<std::int64_t> t0_ns;
  std::optional<std::int64_t> t1_ns;
  bool system = false;  ///< Also print the processor and its kernels; then no recording is needed.
};

/// `event-fusion info`: prints the contents of a recording.
/// @return the process's exit status.
/// @throws std::exception if the recording cannot be read to its end. The contents before the error
/// have been printed.
int runInfo(const InfoArguments& arguments);

}  // namespace efm
