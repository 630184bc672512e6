// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mapping/base/text.h"

namespace efm {

/// A column's name in a header, and the unit in its brackets or after its last underscore, both in
/// lower case: "#timestamp [ns]" is timestamp and ns, "t_us" is t and us, "x_mm" is x and mm. A
/// unit of time alone is a time: "microseconds" is t and us, "header.stamp.sec" is header.stamp.t
/// and sec. Names may be paths with dots or slashes: "%time", "/robot/pose/position/x".
struct HeaderWord {
  std::string name;
  std::string unit;                  ///< Empty if there is no unit.
  std::optional<int> time_exponent;  ///< Exponent of a unit of time.

  bool isTime() const;
  /// Returns the parts of the name between characters that are neither letters nor digits.
  std::vector<std::string_view> parts() const;
};
HeaderWord headerWord(std::string_view text);

/// A table in text: its separator, the lines before its first row, and the names of its columns.
/// All tables are read by it: events, poses, trajectories.
struct TextTable {
  /// ' ' for blanks and tabs, ',', ';', or '\t' for tabs where fields are empty or have blanks.
  char separator = ' ';
  /// True if the text has quotes, or decimal commas beside another separator: see `makePlain`.
  bool decorated = false;
  std::vector<HeaderWord> names;        ///< Of the columns; empty: there is no header.
  std::vector<HeaderWord> other_names;  ///< Those in the last line of words that is no header.
  std::string_view header;         ///< The line of the names, else the last line of other words.
  std::uint64_t header_line = 0;   ///< Its number; 0: there is none.
  std::uint64_t lines_before = 0;  ///< Lines before the first row.
  std::string_view rows;           ///< The text from the first row on; empty: there is none.
  std::string length_unit;         ///< Unit of lengths in a line of keys and values (mocap).

  /// Returns the fields of a line without its comment.
  std::vector<std::string_view> fieldsOf(std::string_view line) const;
  /// Replaces quotes by blanks and decimal commas by points, in the same number of bytes.
  void makePlain(char* begin, char* end) const;
  /// Returns awk with the option of the separator, for commands in errors.
  std::string awk() const;
};

/// Finds the table in a text. Rows have three fields or more, at least half of them numbers. The
/// header is a line before them, also after `#` or `%`, whose names `takes` accepts; several lines
/// with one field for each column are taken together ("Position" above "X"), and a line of units
/// may follow. Other lines before the header are skipped.
TextTable findTable(std::string_view text, bool (*takes)(const std::vector<HeaderWord>&));

/// The columns of the rows' times.
struct TimeColumns {
  std::size_t column = 0;
  std::optional<int> exponent;       ///< Of the unit, if the header names it.
  std::optional<std::size_t> parts;  ///< Parts of a second beside whole seconds: `nanosecondsIn`.
  int parts_exponent = -9;           ///< Of their unit.
};

/// Finds the times: stamps of messages come before times of their receipt, and the names with the
/// longest common beginning with another column's name before others.
std::optional<TimeColumns> timeColumnsOf(const std::vector<HeaderWord>& names,
                                         const std::string& beside);

/// Returns the nanoseconds to add to a time in whole seconds; std::nullopt for seconds with
/// decimals, or parts of more than a second: in the first row, both are times of their own.
std::optional<std::int64_t> nanosecondsIn(std::string_view seconds, std::string_view parts,
                                          int exponent);

/// Returns whether a line is a comment.
inline bool isComment(std::string_view line) {
  return !line.empty() && (line.front() == '#' || line.front() == '%');
}

/// Returns the metres in a unit: 0.001 for "mm" or "millimeters"; std::nullopt for other words.
std::optional<double> metresOf(std::string_view unit);

}  // namespace efm
