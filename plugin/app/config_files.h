// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace efm {

/// The option files that come with the program. They lie in the project's config/, or where
/// `cmake --install` puts them: ../share/event-fusion-mapper/config from the program.

/// Their names without ".ini", sorted: "default", "dsec", …
std::vector<std::string> configNames();

/// The option file of a name. A path is returned as it is.
/// @throws UsageError if there is no such file, or naming the known names if it is none of them.
std::filesystem::path findConfig(const std::string& name_or_path);

}  // namespace efm
