// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "plugin/recordings/streams/recording_parts.h"
#include "plugin/recordings/streams/time_unit.h"
#include "plugin/recordings/text/text_table.h"

namespace efm {

/// The numbers of some events: a row per event, a number per column.
using EventRows = std::vector<std::vector<double>>;

/// An order of the columns t, x, y and p, a letter per column.
struct ColumnOrder {
  std::string order;
  /// True if the values allow one order only. (x and y cannot be distinguished; the first of the
  /// two is taken as x.) False for few lines or events of one polarity.
  bool certain = false;
};

/// Finds the order of four columns from their values: times rise, polarities are 0 and 1 or -1 and
/// 1, pixels are whole numbers that rise and fall. The expected order is returned if it is
/// possible.
/// @param rows rows that do not have four numbers are ignored.
/// @return std::nullopt if the values show no order, or several orders.
std::optional<ColumnOrder> orderOfValues(const EventRows& rows, const std::string& expected);

/// The positions of an event's numbers in a row of a text.
struct EventColumns {
  /// A letter per column; 'c' for the camera's name, 'n' for parts of a second beside whole
  /// seconds, '-' for a column to ignore.
  std::string order = "txyp";
  TextTable table;                 ///< Without its texts.
  int time_exponent = 0;           ///< The unit of times is 10^time_exponent s.
  int parts_exponent = -9;         ///< That of 'n'.
  std::optional<CameraSize> size;  ///< Size in a first line `width height`.
  std::vector<Warning> warnings;   ///< Set if only the values show order or unit.

  /// True for t x y p in seconds, separated by blanks.
  bool isUsual() const { return order == "txyp" && table.separator == ' ' && time_exponent == 0; }
};

/// Finds the columns from the beginning of a file. A first line with names (t or time …, x or col
/// …, y or row …, p or pol …, also after a `#`) gives order and unit. A first line with two whole
/// numbers gives the sensor's size. Options have priority. Without names and options, the order is
/// t x y p, or the order that the values show (`orderOfValues`), with a warning.
/// @param beginning complete lines from the beginning of the file.
/// @param file name of the file, for errors.
/// @throws std::runtime_error if `--event-columns` is wrong or contradicts the values, if the order
/// is likely but not certain, or if the unit of time is not certain (`findTimeUnit`).
EventColumns findEventColumns(std::string beginning, const ReaderOptions& options,
                              const std::string& file);

/// Returns whether the beginning of a file is text whose first line with numbers is an event: it
/// has four numbers, or one per name of a header or letter of the option. Polarities may be words.
/// @param option value of `--event-columns`.
bool looksLikeEventLines(std::string_view beginning, const std::string& option = {});

/// Returns whether a text has rows of numbers, or a header of events.
bool hasEventTable(std::string_view beginning);

/// Returns 0, 1 or -1, also of "1.0"; 1 for "true" and "on", 0 for "false" and "off", in any case.
std::optional<int> polarityOf(std::string_view text);

inline constexpr const char* kExpectedPolarity =
    "polarity 0 or 1, or -1 or 1, or True or False, or ON or OFF";

/// Returns the column that a name means: 't', 'x', 'y' or 'p', 'c' for the camera of the event, or
/// '-' for an unknown name.
char eventColumnOf(const HeaderWord& word);

/// The letters of an event's columns.
inline constexpr std::string_view kEventColumns = "txyp";

/// The names of arrays, data sets or fields, in the order of `kEventColumns`.
using EventNames = std::array<std::string, 4>;
bool hasAll(const EventNames& names);

/// Returns the letters in `--event-columns "t x y p"`.
/// @throws std::runtime_error unless they are t, x, y and p, each once, c and n (nanoseconds beside
/// seconds) at most once, and - for ignored columns.
std::string orderOfOption(const std::string& text);

/// Returns the names in `--event-columns "t=NAME x=NAME y=NAME p=NAME"`.
/// @return std::nullopt if the option has no `=`.
/// @throws std::runtime_error if the option does not name each column once.
std::optional<EventNames> eventNamesOf(const std::string& option);

/// Returns the text for the expected value of a pixel. @param found the value that is no pixel.
inline std::string expectedPixel(double found) {
  std::string expected = "a whole number from 0 to 65535";
  if (std::floor(found) != found) {
    expected += "; rectified events have fractions: give them as the sensor wrote them";
  }
  return expected;
}

}  // namespace efm
