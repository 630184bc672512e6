// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace efm {

/// Why the first bytes are not those of a rawlog: "it begins with …"; nothing where they are, and
/// of a damaged gzip file.
std::optional<std::string> whyNoRawlog(const std::filesystem::path& file);

/// Checks the first bytes of a rawlog, compressed or not: the name of an object's class, as MRPT
/// writes it. Does not check for later damage.
/// @throws std::runtime_error naming the file, its first bytes and the expected kind of file, or if
/// it cannot be opened.
void requireRawlog(const std::filesystem::path& file);

}  // namespace efm
