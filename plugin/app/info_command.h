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
};

/// `event-fusion info`: reads a recording and says what is in it.
/// @return the process's exit status.
/// @throws std::exception where the recording cannot be read to its end; what was found by then has
/// been printed.
int runInfo(const InfoArguments& arguments);

}  // namespace efm
