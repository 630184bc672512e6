// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace efm {

/// What a file or folder is that no reader takes, and what to do instead: "a PNG picture: expected
/// events". Nothing where it is not known, too. Known formats are found by their first bytes, also
/// within compressed files. Never throws.
std::optional<std::string> unreadFormat(const std::filesystem::path& source);

}  // namespace efm
