// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace efm {

/// Text of a file for an error message: one line, without control characters for the terminal.

/// The first `max_characters`, followed by "…" where there are more. Characters other than
/// printable ASCII become \xNN.
std::string printable(std::string_view text, std::size_t max_characters = 40);

/// `printable` with its default length, between single quotes.
std::string inQuotes(std::string_view text);

}  // namespace efm
