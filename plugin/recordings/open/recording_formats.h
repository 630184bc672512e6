// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// The formats that this build reads, in the order in which they are tried. Rawlogs are not among
/// them: they hold observations, not parts.
const std::vector<RecordingFormat>& readerFormats();

/// The format of a file or folder by its content; null if it is none of `readerFormats`.
const RecordingFormat* detectFormat(const std::filesystem::path& source);

}  // namespace efm
