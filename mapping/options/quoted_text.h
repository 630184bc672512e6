// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace efm {

/// Text of a file as an error may show it: whatever the file holds, a terminal shows it on one line
/// and obeys none of it.

/// At most `max_characters`, "…" where that cuts; what is not printable ASCII becomes \xNN.
std::string printable(std::string_view text, std::size_t max_characters = 40);

/// The same, of at most 40 characters, between single quotes.
std::string inQuotes(std::string_view text);

}  // namespace efm
