// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "plugin/recordings/streams/recording_parts.h"
#include "plugin/recordings/streams/time_unit.h"

namespace efm {

/// The numbers of some events, a number per column.
using EventRows = std::vector<std::vector<double>>;

/// An order of the columns t, x, y and p, a letter per column.
struct ColumnOrder {
  std::string order;
  /// Whether the values leave no other order, but for x and y: they cannot be told apart, and x is
  /// the first of them. Few lines, or events of one polarity, leave doubts.
  bool certain = false;
};

/// The order of four columns as their values show it: times rise, the polarity has the values 0 and
/// 1 or -1 and 1, pixels are whole numbers that come and go. An order that is expected and possible
/// comes before all others.
/// @param rows of which those without four numbers are ignored.
/// @return nothing where the values show no order, or several.
std::optional<ColumnOrder> orderOfValues(const EventRows& rows, const std::string& expected);

/// Where the numbers of an event stand in a line of text.
struct EventColumns {
  std::string order = "txyp";      ///< A letter per column; '-' for one to ignore.
  char separator = ' ';            ///< ',' or ';'; blanks separate, too.
  int time_exponent = 0;           ///< Times count 10^time_exponent seconds.
  std::uint64_t header_lines = 0;  ///< To skip at the beginning of the file.
  std::optional<CameraSize> size;  ///< From a first line `width height`.
  std::vector<Warning> warnings;   ///< Where the values alone say order or unit.

  /// t x y p in seconds, between blanks.
  bool isUsual() const { return order == "txyp" && separator == ' ' && time_exponent == 0; }
};

/// Finds the columns from the beginning of a file. A first line with names (t or time …, x or col
/// …, y or row …, p or pol …, also behind a `#`) gives order and unit, one with two whole numbers
/// the sensor's size; options come before both. Without them: t x y p, or the order that the values
/// show (`orderOfValues`), with a warning.
/// @param beginning whole lines.
/// @param file for errors.
/// @throws std::runtime_error where `--event-columns` is wrong, also by the values; where the order
/// is likely but not certain; where the unit of time is not certain (`findTimeUnit`).
EventColumns findEventColumns(std::string_view beginning, const ReaderOptions& options,
                              const std::string& file);

/// Whether the beginning of a file is text whose first line with numbers has those of an event:
/// four of them, or one per name of a header or letter of the option. Polarities may be words.
/// @param option `--event-columns`.
bool looksLikeEventLines(std::string_view beginning, const std::string& option = {});

/// Why `looksLikeEventLines` does not hold of text with numbers: "3: '1 2 3': 3 fields: expected
/// …", beginning with the line; nothing where the first line with numbers has more words.
std::optional<std::string> whyNoEventLines(std::string_view beginning);

/// 0, 1 or -1, also as 1.0; true and on are 1, false and off 0, in any letters.
std::optional<int> polarityOf(std::string_view text);

inline constexpr const char* kExpectedPolarity =
    "polarity 0 or 1, or -1 or 1, or True or False, or ON or OFF";

/// The column that a name means: 't', 'x', 'y', 'p', or '-' for another one.
char eventColumnOf(const HeaderWord& word);

/// The order of columns without names, a letter each: that of `--event-columns` if there is one,
/// else `usual` or the one that the values show, which is said.
/// @throws std::runtime_error where the option is wrong, also by the values; where the order is
/// likely but not certain.
std::string findColumnOrder(const EventRows& rows, const ReaderOptions& options,
                            const std::string& file, std::vector<Warning>& warnings);

/// The columns of an event.
inline constexpr std::string_view kEventColumns = "txyp";

/// The names of the columns, in the order of `kEventColumns`: of arrays, data sets or fields.
using EventNames = std::array<std::string, 4>;
bool hasAll(const EventNames& names);

/// The names that `--event-columns "t=NAME x=NAME y=NAME p=NAME"` gives.
/// @return nothing where the option has no `=`.
/// @throws std::runtime_error where it does not name each of them once.
std::optional<EventNames> eventNamesOf(const std::string& option);

/// The fields of a line, between separators and blanks.
std::vector<std::string_view> eventFields(std::string_view line, char separator);

}  // namespace efm
