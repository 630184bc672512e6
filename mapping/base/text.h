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

/// Something implausible, which does not stop a run: docs/recordings.md has a table of the names.
struct Warning {
  std::string name;  ///< "clock-overlap"
  std::string text;  ///< A sentence with the values, and the option or file that fixes it.
};

/// Text of a file for an error message: one line, without control characters for the terminal.

/// The first `max_characters`, followed by "…" where there are more. Characters other than
/// printable ASCII become \xNN.
std::string printable(std::string_view text, std::size_t max_characters = 40);

/// `printable` with its default length, between single quotes.
std::string inQuotes(std::string_view text);

/// Blanks within and at the end of a line.
inline constexpr std::string_view kLineBlanks = " \t\r\v\f";

/// Parses the whole text as a number. Real numbers may be infinite or NaN.
/// @return std::nullopt if the text is no number, or the type cannot hold it.
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

/// A text without the mark of UTF-8 that some editors put at its beginning.
inline std::string_view withoutByteOrderMark(std::string_view text) {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  if (text.substr(0, kMark.size()) == kMark) text.remove_prefix(kMark.size());
  return text;
}

/// The text without blanks at both ends.
std::string_view trimmed(std::string_view text);

/// Takes the first line from a text: the line, without its line break.
std::string_view takeLine(std::string_view& text);

/// The parts of a line between separators, trimmed. Behind a separator at the end is none.
std::vector<std::string_view> splitFields(std::string_view line, std::string_view separators);

/// The words of a text, which blanks separate. They are views of the text.
std::vector<std::string_view> splitWords(std::string_view text,
                                         std::string_view blanks = kLineBlanks);

/// Makes text of numbers. Other streams follow the locale of the host program, which may group
/// digits (1.500) or write decimal commas.
class NumberText : public std::ostringstream {
 public:
  /// @param digits significant ones: 17 are all of a double.
  explicit NumberText(int digits = 17) {
    imbue(std::locale::classic());
    precision(digits);
  }
};

}  // namespace efm
