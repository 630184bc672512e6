// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "plugin/recordings/open/open_recording.h"

namespace efm {

/// Returns the files and folders from which a recording is read.
std::vector<std::filesystem::path> inputsOf(const RecordingSource& source);

/// Rejects an output that would replace an input. Links are followed, and hard links are found.
/// @param out file or folder to write. A folder must neither be an input nor hold an input.
/// @param inputs empty or missing inputs are ignored.
void rejectReplacing(const std::filesystem::path& out,
                     const std::vector<std::filesystem::path>& inputs);

}  // namespace efm
