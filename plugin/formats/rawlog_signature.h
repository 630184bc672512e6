// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

namespace efm {

/// Checks the first bytes of a file, compressed or not: a rawlog begins with the name of an
/// object's class. Damage after that is not detected here.
/// @throws std::runtime_error naming the file, its first bytes and what was expected; or if the
/// file cannot be opened.
void requireRawlog(const std::filesystem::path& file);

}  // namespace efm
