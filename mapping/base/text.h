// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <charconv>
#include <cmath>
#include <cstddef>
#include <locale>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace efm {

/// An implausible finding that does not stop a run. docs/recordings.md has a table of the names.
struct Warning {
  std::string name;  ///< "clock-overlap"
  std::string text;  ///< A sentence with the values, and the option or file that would fix it.
};

/// Functions that make text of a file safe for error messages: one line, no control characters.

/// Returns the first `max_characters`, followed by "…" if the text is longer. Characters other than
/// printable ASCII become `\\xNN`.
std::string printable(std::string_view text, std::size_t max_characters = 40);

/// Returns `printable(text)` between single quotes.
std::string inQuotes(std::string_view text);

/// Blanks within and at the end of a line.
inline constexpr std::string_view kLineBlanks = " \t\r\v\f";

/// Parses the whole text as a number. Real numbers may be infinite or NaN.
/// @return std::nullopt if the text is not a number, or the type cannot hold it.
template <typename Number>
std::optional<Number> parseNumber(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

/// Parses the whole text as a finite number.
inline std::optional<double> parseFinite(std::string_view text) {
  const std::optional<double> number = parseNumber<double>(text);
  return number && std::isfinite(*number) ? number : std::nullopt;
}

/// Returns the text without the byte order mark (UTF-8) that some editors put at its beginning.
inline std::string_view withoutByteOrderMark(std::string_view text) {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  if (text.substr(0, kMark.size()) == kMark) text.remove_prefix(kMark.size());
  return text;
}

/// Returns the text without blanks at both ends.
std::string_view trimmed(std::string_view text);

/// Removes the first line from a text. @return the line without its line break.
std::string_view takeLine(std::string_view& text);

/// Returns the parts of a line between separators, trimmed. An empty last part is left out.
std::vector<std::string_view> splitFields(std::string_view line, std::string_view separators);

/// Returns the words of a text, separated by blanks. They are views of the text.
std::vector<std::string_view> splitWords(std::string_view text,
                                         std::string_view blanks = kLineBlanks);

/// A stream that writes numbers in the "C" locale. Other streams follow the locale of the host
/// program, which may group digits (1.500) or write decimal commas.
class NumberText : public std::ostringstream {
 public:
  /// @param digits significant digits: 17 restore every double exactly.
  explicit NumberText(int digits = 17) {
    imbue(std::locale::classic());
    precision(digits);
  }
};

}  // namespace efm
