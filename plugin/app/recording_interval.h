// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "plugin/formats/open_recording.h"

namespace efm {

/// Opens the interval [t0, t1) of a recording: its events, and the poses around them (see TimeCut).
/// Most events outside are not read, where the format has an index.
std::unique_ptr<Recording> openInterval(RecordingSource source, std::optional<std::int64_t> t0_ns,
                                        std::optional<std::int64_t> t1_ns);

/// A warning if the recording says that it lacks packets.
std::optional<std::string> lostPacketsWarning(const RecordingCounts& counts);
/// Prints it to stderr.
void warnOfLostPackets(const RecordingCounts& counts);

}  // namespace efm
