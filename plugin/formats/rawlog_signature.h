// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

namespace efm {

/// Checks the first bytes of a rawlog, compressed or not: the name of an object's class, as MRPT
/// writes it. Does not check for later damage.
/// @throws std::runtime_error naming the file, its first bytes and the expected kind of file, or if
/// it cannot be opened.
void requireRawlog(const std::filesystem::path& file);

}  // namespace efm
