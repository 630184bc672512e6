// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// Returns whether a file begins with the header of a RAW file with EVT words.
bool looksLikePropheseeRaw(const std::filesystem::path& file);

/// Opens files, one camera per file. Times are those of the sensor's clock: see EvtDecoder.
RecordingParts openPropheseeRaw(const std::vector<std::filesystem::path>& files,
                                const ReaderOptions& options);

}  // namespace efm
