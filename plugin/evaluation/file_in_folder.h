// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <initializer_list>

namespace efm {

/// A folder stands for the first of these files that it has; a path that is no folder for itself.
/// @throws std::runtime_error naming the folder and the files where it has none of them.
std::filesystem::path fileInFolder(const std::filesystem::path& path,
                                   std::initializer_list<const char*> names);

}  // namespace efm
