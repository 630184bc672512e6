// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "plugin/recordings/open/open_recording.h"

namespace efm {

/// The option files that come with the program. They lie in the project's config/, or where
/// `cmake --install` puts them: ../share/event-fusion-mapper/config from the program.

/// Their names without ".ini", sorted: "default", "dsec", …
std::vector<std::string> configNames();

/// The option file of a name. A path is returned as it is.
/// @throws UsageError if there is no such file, or naming the known names if it is none of them.
std::filesystem::path findConfig(const std::string& name_or_path);

/// The files and folders that a recording is read from.
std::vector<std::filesystem::path> inputsOf(const RecordingSource& source);

/// Refuses an output that would replace an input. Links are followed, and hard links are found.
/// @param out the file or the folder to write. A folder must neither be an input nor hold one.
/// @param inputs those that are empty or do not exist are left out.
void refuseToReplace(const std::filesystem::path& out,
                     const std::vector<std::filesystem::path>& inputs);

/// Refuses an existing file in one of the folders that are read.
void refuseFileIn(const std::vector<std::filesystem::path>& folders,
                  const std::filesystem::path& out);

}  // namespace efm
