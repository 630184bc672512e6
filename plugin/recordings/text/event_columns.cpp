// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/text/event_columns.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "mapping/base/text.h"
#include "plugin/recordings/text/pose_text.h"

namespace efm {
namespace {

constexpr std::size_t kSampledLines = 5000;

bool isComplete(const std::string& order) {
  return std::all_of(
             kEventColumns.begin(), kEventColumns.end(),
             [&](char column) { return std::count(order.begin(), order.end(), column) == 1; }) &&
         std::count(order.begin(), order.end(), 'c') <= 1 &&
         std::count(order.begin(), order.end(), 'n') <= 1;
}

/// Returns a letter per name of a header.
std::string orderOfNames(const std::vector<HeaderWord>& names) {
  std::string order;
  for (const HeaderWord& word : names) order += word.isTime() ? '-' : eventColumnOf(word);
  const auto time = timeColumnsOf(names, "");
  if (time) order[time->column] = 't';
  if (time && time->parts) order[*time->parts] = 'n';
  return order;
}

bool namesEvents(const std::vector<HeaderWord>& names) { return isComplete(orderOfNames(names)); }

std::string asWords(const std::string& order) { return fmt::format("{}", fmt::join(order, " ")); }

using TextRows = std::vector<std::vector<std::string_view>>;

std::optional<double> numberOf(std::string_view text) {
  if (const auto number = parseFinite(text)) return number;
  return polarityOf(text);
}

/// Returns the numbers of the lines in which all fields are numbers.
EventRows numbersOf(const TextRows& lines) {
  EventRows rows;
  for (const std::vector<std::string_view>& line : lines) {
    std::vector<double> row;
    for (const std::string_view field : line) {
      const std::optional<double> number = numberOf(field);
      if (number) row.push_back(*number);
    }
    if (row.size() == line.size()) rows.push_back(std::move(row));
  }
  return rows;
}

TimeSample timesIn(const TextRows& rows, const EventColumns& columns) {
  const std::size_t t_column = columns.order.find('t');
  TimeSample sample;
  for (const std::vector<std::string_view>& row : rows) {
    if (row.size() != columns.order.size()) continue;
    const std::string_view text = row[t_column];
    const std::optional<double> t = parseFinite(text);
    if (t) sample.add(*t, text);
  }
  return sample;
}

/// The beginning of a text, made plain, and its first rows.
struct EventText {
  std::string text;
  TextTable table;
  std::string order = EventColumns().order;  // the header's order, else the usual order
  std::optional<CameraSize> size;
  TextRows rows;

  explicit EventText(std::string beginning) : text(std::move(beginning)) {
    table = findTable(text, namesEvents);
    char* const end = text.data() + text.size();
    table.makePlain(end - table.rows.size(), end);
    if (!table.names.empty()) order = orderOfNames(table.names);
    std::string_view before(text.data(), text.size() - table.rows.size());
    while (!before.empty() && !size) {
      const auto fields = splitWords(takeLine(before), " \t\r,;");
      if (fields.size() == 2) size = cameraSizeOf(fields[0], fields[1]);
    }
    for (std::string_view rest = table.rows; rows.size() < kSampledLines && !rest.empty();) {
      rows.push_back(table.fieldsOf(takeLine(rest)));
    }
  }
};

/// Returns the order of columns without names, a letter each. It is the order of `--event-columns`
/// if given, else t x y p or the order that the values show, with a warning.
/// @throws std::runtime_error if the option is wrong or contradicts the values, or if the order is
/// likely but not certain.
std::string findColumnOrder(const EventRows& rows, const ReaderOptions& options,
                            const std::string& file, std::vector<Warning>& warnings) {
  if (!options.columns.empty()) {
    const std::string order = orderOfOption(options.columns);
    const std::optional<ColumnOrder> found = orderOfValues(rows, order);
    if (!found || !found->certain || found->order == order) return order;
    throw std::runtime_error(
        fmt::format("--event-columns {}: the columns of {} are {} by their values",
                    inQuotes(options.columns), file, asWords(found->order)));
  }
  const std::string usual = EventColumns().order;
  const std::optional<ColumnOrder> found = orderOfValues(rows, usual);
  if (!found || found->order == usual) return usual;
  const std::string words = asWords(found->order);
  if (!found->certain) {
    throw std::runtime_error(
        fmt::format("{}: by their values, the columns are probably {}: expected {}, a header with "
                    "their names, or --event-columns \"{}\"",
                    file, words, asWords(usual), words));
  }
  warnings.push_back(
      {"event-columns", fmt::format("{}: by their values, the columns are {} (--event-columns "
                                    "\"{}\")",
                                    file, words, words)});
  return found->order;
}

}  // namespace

std::string orderOfOption(const std::string& text) {
  std::string order;
  for (const std::string_view word : splitWords(text, " ,")) order += word;
  if (isComplete(order) && order.find_first_not_of("txypcn-") == std::string::npos) return order;
  throw std::runtime_error(
      fmt::format("--event-columns {}: expected t, x, y and p, each once, n for nanoseconds beside "
                  "seconds, c for a column with the camera, and - for a column to ignore",
                  inQuotes(text)));
}

EventColumns findEventColumns(std::string beginning, const ReaderOptions& options,
                              const std::string& file) {
  const EventText text(std::move(beginning));
  EventColumns columns;
  columns.table = text.table;
  columns.table.header = columns.table.rows = {};
  columns.order = text.order;
  columns.size = text.size;
  const bool named = !text.table.names.empty();
  const std::string other = orderOfNames(text.table.other_names);
  if (options.columns.empty() && !named && !text.rows.empty() &&
      std::count(other.begin(), other.end(), '-') + 2 <=
          static_cast<std::ptrdiff_t>(other.size())) {
    for (const char column : kEventColumns) {
      if (std::count(other.begin(), other.end(), column) == 1) continue;
      throw std::runtime_error(
          fmt::format("{}:{}: {}: there is no one column {}: expected one each of t, x, y and p "
                      "(--event-columns)",
                      file, text.table.header_line, inQuotes(text.table.header), column));
    }
  }
  if (!options.columns.empty() || !named) {
    columns.order = findColumnOrder(numbersOf(text.rows), options, file, columns.warnings);
  }
  if (options.columns.empty() && !named && !text.rows.empty() && text.table.header_line > 0 &&
      text.rows.front().size() == columns.order.size()) {
    const std::string words = asWords(columns.order);
    columns.warnings = {
        {"event-columns", fmt::format("{}: the header {} is not understood: the columns are read "
                                      "as {} (--event-columns \"{}\")",
                                      file, inQuotes(text.table.header), words, words)}};
  }
  const std::size_t t = columns.order.find('t');
  const std::size_t ns = columns.order.find('n');
  if (ns < columns.order.size() && !text.rows.empty()) {
    const auto& row = text.rows.front();
    if (named && options.columns.empty())
      columns.parts_exponent = *text.table.names[ns].time_exponent;
    const bool whole = row.size() == columns.order.size() &&
                       nanosecondsIn(row[t], row[ns], columns.parts_exponent);
    if (!whole) columns.order[ns] = '-';
  }
  if (!options.time_unit.empty()) {
    columns.time_exponent = *timeExponentOf(options.time_unit);
  } else if (columns.order.find('n') != std::string::npos) {
    columns.time_exponent = 0;
  } else if (named && t < text.table.names.size() && !text.table.names[t].unit.empty()) {
    const HeaderWord& word = text.table.names[t];
    if (!word.time_exponent) {
      throw std::runtime_error(fmt::format("{}:{}: the unit {} of t: expected s, ms, us or ns",
                                           file, text.table.header_line, inQuotes(word.unit)));
    }
    columns.time_exponent = *word.time_exponent;
  } else {
    TimeUnit unit = findTimeUnit(options, timesIn(text.rows, columns), kUsualEventRate, file);
    columns.time_exponent = unit.exponent;
    if (unit.warning) columns.warnings.push_back(std::move(*unit.warning));
  }
  return columns;
}

bool looksLikeEventLines(std::string_view beginning, const std::string& option) {
  if (beginning.find('\0') != std::string_view::npos) return false;
  const EventText text{std::string(beginning)};
  if (text.rows.empty()) return false;
  const std::size_t count = text.rows.front().size();
  std::string order = text.order;
  if (!option.empty() && option.find('=') == std::string::npos) {
    order = orderOfOption(option);
  } else if (count == 4 && order.size() != 4) {
    order = "txyp";
  } else if (count == 8 && text.table.names.empty()) {
    return false;  // a pose
  }
  if (count != order.size()) return false;
  for (std::size_t k = 0; k < count; ++k) {
    if (kEventColumns.find(order[k]) == std::string_view::npos) continue;
    if (!numberOf(text.rows.front()[k])) return false;
  }
  return true;
}

bool hasEventTable(std::string_view beginning) {
  const EventText text{std::string(beginning)};
  return beginning.find('\0') == beginning.npos &&
         (!text.rows.empty() || !text.table.names.empty());
}

std::optional<int> polarityOf(std::string_view text) {
  if (const auto number = parseFinite(text)) {
    const bool is_polarity = *number == 0 ? text.front() == '0' : std::abs(*number) == 1;
    const bool has_zeros = text.size() > 1 && text[0] == '0' && text[1] != '.';
    return is_polarity && !has_zeros ? std::optional(static_cast<int>(*number)) : std::nullopt;
  }
  std::string small;
  for (const char c : text) small += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (small == "true" || small == "on") return 1;
  if (small == "false" || small == "off") return 0;
  return std::nullopt;
}

char eventColumnOf(const HeaderWord& word) {
  constexpr struct {
    char column;
    std::string_view names;  // between blanks
  } kNames[] = {
      {'x',
       " x xs u col column x_pos pos_x xpos posx x_px px_x pixel_x x_pixel x_coord coord_x "
       "x_coordinate x_addr "},
      {'y',
       " y ys v row y_pos pos_y ypos posy y_px px_y pixel_y y_pixel y_coord coord_y "
       "y_coordinate y_addr "},
      {'c',
       " camera camera_id camera_name camera_index cameraid cam cam_id cam_index camid sensor "
       "sensor_id device device_id "},
      {'p', " p ps pol pols polarity polarities on on_off sign "}};
  if (word.isTime()) return 't';
  for (const auto& [column, names] : kNames) {
    const std::string name = " " + word.name + " ";
    if (names.find(name) != std::string_view::npos) return column;
  }
  return '-';
}

std::optional<EventNames> eventNamesOf(const std::string& option) {
  if (option.find('=') == std::string::npos) return std::nullopt;
  EventNames names;
  bool once = true;
  for (const std::string_view word : splitWords(option, " ,")) {
    const bool is_name = word.size() > 2 && word[1] == '=';
    const std::size_t column = is_name ? kEventColumns.find(word[0]) : std::string_view::npos;
    once = once && column != std::string_view::npos && names[column].empty();
    if (once) names[column] = word.substr(2);
  }
  if (once && hasAll(names)) return names;
  throw std::runtime_error(fmt::format(
      "--event-columns {}: expected t=NAME x=NAME y=NAME p=NAME, each once", inQuotes(option)));
}

bool hasAll(const EventNames& names) {
  return std::none_of(names.begin(), names.end(), [](const auto& name) { return name.empty(); });
}

namespace {

constexpr std::size_t kColumns = kEventColumns.size();

/// Statistics of a column's values.
struct ColumnValues {
  bool whole = true;
  double min = std::numeric_limits<double>::infinity();
  double max = -min;
  double max_drop = 0;  // largest difference to an earlier, larger value
  bool has_zero = false;
  bool has_one = false;
  bool has_minus_one = false;
  bool has_others = false;

  void add(double value) {
    whole = whole && std::floor(value) == value;
    min = std::min(min, value);
    max = std::max(max, value);
    max_drop = std::max(max_drop, max - value);
    has_zero |= value == 0;
    has_one |= value == 1;
    has_minus_one |= value == -1;
    has_others |= value != 0 && value != 1 && value != -1;
  }
  /// True for times, of which some may be late. Pixels rise and fall over the whole image.
  bool rises() const { return max > min && max_drop <= 0.1 * (max - min); }
  bool mayBeTime() const { return rises() || max == min || !whole; }
  bool mayBePolarity() const { return whole && !has_others && !(has_zero && has_minus_one); }
  bool hasBothPolarities() const { return has_one && (has_zero || has_minus_one); }
  bool mayBePixel() const { return whole && min >= 0 && max <= 65'535; }
};

using AllValues = std::array<ColumnValues, kColumns>;

/// @return the number of rows that have four numbers.
std::size_t addRows(const EventRows& rows, AllValues& columns) {
  std::size_t count = 0;
  for (const std::vector<double>& row : rows) {
    if (row.size() != kColumns) continue;
    for (std::size_t k = 0; k < kColumns; ++k) columns[k].add(row[k]);
    ++count;
  }
  return count;
}

/// @param strict true if times must rise and pixels must differ.
bool isPossible(const AllValues& columns, const std::string& order, bool strict) {
  for (std::size_t k = 0; k < kColumns; ++k) {
    const ColumnValues& values = columns[k];
    const bool varies = values.max - values.min >= 2;
    if (order[k] == 't' && !(strict ? values.rises() : values.mayBeTime())) return false;
    if (order[k] == 'p' && !values.mayBePolarity()) return false;
    const bool is_pixel = order[k] == 'x' || order[k] == 'y';
    if (is_pixel && !(values.mayBePixel() && (varies || !strict))) return false;
  }
  return true;
}

std::vector<std::string> allOrders() {
  std::vector<std::string> orders;
  std::string order = "ptxy";  // sorted
  do {
    if (order.find('x') < order.find('y')) orders.push_back(order);
  } while (std::next_permutation(order.begin(), order.end()));
  return orders;
}

}  // namespace

std::optional<ColumnOrder> orderOfValues(const EventRows& rows, const std::string& expected) {
  constexpr std::size_t kFew = 10;    // fewer rows prove nothing
  constexpr std::size_t kMany = 100;  // this number of rows proves the order
  AllValues columns;
  const std::size_t count = addRows(rows, columns);
  if (count < kFew) return std::nullopt;
  if (expected.size() == kColumns && isPossible(columns, expected, false)) {
    return ColumnOrder{expected, true};
  }
  std::optional<ColumnOrder> found;
  for (const std::string& order : allOrders()) {
    if (!isPossible(columns, order, true)) continue;
    if (found) return std::nullopt;
    const ColumnValues& polarity = columns[order.find('p')];
    found = ColumnOrder{order, count >= kMany && polarity.hasBothPolarities()};
  }
  return found;
}

}  // namespace efm
