// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <initializer_list>

namespace efm {

/// For a folder: the first of these files that it has. For another path: the path itself.
/// @throws std::runtime_error naming the folder and the files if it has none of them.
std::filesystem::path fileInFolder(const std::filesystem::path& path,
                                   std::initializer_list<const char*> names);

}  // namespace efm
