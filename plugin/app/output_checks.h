// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "plugin/recordings/open/open_recording.h"

namespace efm {

/// The option files of the program lie in the project's config/, or where `cmake --install` puts
/// them: ../share/event-fusion-mapper/config from the program.

/// Returns the names of the option files without ".ini", sorted: "default", "dsec", …
std::vector<std::string> configNames();

/// Returns the option file of a name. A path is returned unchanged.
/// @throws UsageError if there is no such file, or, with the known names, if the name is unknown.
std::filesystem::path findConfig(const std::string& name_or_path);

/// Returns the files and folders from which a recording is read.
std::vector<std::filesystem::path> inputsOf(const RecordingSource& source);

/// Rejects an output that would replace an input. Links are followed, and hard links are found.
/// @param out file or folder to write. A folder must neither be an input nor hold an input.
/// @param inputs empty or missing inputs are ignored.
void rejectReplacing(const std::filesystem::path& out,
                     const std::vector<std::filesystem::path>& inputs);

/// Rejects an existing file in a folder that is read.
void rejectFileIn(const std::vector<std::filesystem::path>& folders,
                  const std::filesystem::path& out);

}  // namespace efm
