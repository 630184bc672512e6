// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

namespace efm {

/// Whether a file can be a rawlog, by its first bytes, compressed or not: it begins with the name
/// of an object's class, as MRPT writes it. One that was cut or damaged later can, too.
/// @throws std::runtime_error naming the file, how it begins and what was expected; where it cannot
/// be opened.
void requireRawlog(const std::filesystem::path& file);

}  // namespace efm
