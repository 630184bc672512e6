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

/// Returns a line's separator. If it has semicolons, its commas are decimal commas.
char separatorOf(std::string_view line) {
  if (line.find(';') != std::string_view::npos) return ';';
  return line.find(',') != std::string_view::npos ? ',' : ' ';
}

bool hasNumber(const std::vector<std::string_view>& fields) {
  return std::any_of(fields.begin(), fields.end(),
                     [](std::string_view field) { return parseNumber<double>(field).has_value(); });
}

bool isComplete(const std::string& order) {
  return std::all_of(
             kEventColumns.begin(), kEventColumns.end(),
             [&](char column) { return std::count(order.begin(), order.end(), column) == 1; }) &&
         std::count(order.begin(), order.end(), 'c') <= 1;
}

bool isComment(std::string_view line) {
  return !line.empty() && (line.front() == '#' || line.front() == '%');
}

/// Facts about the lines before the first event.
struct Header {
  bool named = false;               // a line names the columns
  std::string_view not_understood;  // a line of unknown words
};

/// Takes order and unit from a line of names. Keeps both if the line does not name all columns.
/// @return whether the line names all columns.
bool takeNames(std::string_view line, EventColumns& columns) {
  if (isComment(line)) line = trimmed(line.substr(1));
  std::string order;
  std::optional<int> exponent;
  for (const std::string_view field : eventFields(line, separatorOf(line))) {
    const HeaderWord word = headerWord(field);
    order += eventColumnOf(word);
    if (order.back() == 't') exponent = word.time_exponent;
  }
  if (!isComplete(order)) return false;
  columns.order = order;
  if (exponent) columns.time_exponent = *exponent;
  return true;
}

}  // namespace

std::string orderOfOption(const std::string& text) {
  std::string order;
  for (const std::string_view word : splitWords(text, " ,")) order += word;
  if (isComplete(order) && order.find_first_not_of("txypc-") == std::string::npos) return order;
  throw std::runtime_error(
      fmt::format("--event-columns {}: expected t, x, y and p, each once, c for a column with the "
                  "camera, and - "
                  "for a column to ignore",
                  inQuotes(text)));
}

namespace {

/// Skips the lines before the first event. @return the rest of the text.
std::string_view takeHeader(std::string_view text, EventColumns& columns, Header& header) {
  for (std::uint64_t lines = 0; !text.empty();) {
    const std::string_view rest = text;
    const std::string_view line = trimmed(takeLine(text));
    ++lines;
    const bool comment = isComment(line);
    const std::vector<std::string_view> fields = eventFields(line, separatorOf(line));
    if (line.empty()) continue;
    std::optional<CameraSize> size;
    if (!comment && fields.size() == 2) size = cameraSizeOf(fields[0], fields[1]);
    if (!comment && !size && hasNumber(fields)) return rest;
    if (size && (columns.size || text.empty())) return rest;
    if (size) columns.size = size;
    if (!size && takeNames(line, columns)) {
      header.named = true;
    } else if (!size && !comment && fields.size() >= 4) {
      header.not_understood = line;
    }
    columns.header_lines = lines;
  }
  return {};
}

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

/// Warns of a header that is not understood, if the lines have the expected number of columns.
void warnOfHeader(const TextRows& rows, const Header& header, const std::string& file,
                  EventColumns& columns) {
  if (header.not_understood.empty() || rows.empty() ||
      rows.front().size() != columns.order.size()) {
    return;
  }
  const std::string words = asWords(columns.order);
  columns.warnings = {
      {"event-columns", fmt::format("{}: the header {} is not understood: the columns are read as "
                                    "{} (--event-columns \"{}\")",
                                    file, inQuotes(header.not_understood), words, words)}};
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

/// The first line with numbers.
struct FirstEvent {
  std::uint64_t line = 0;
  std::string_view text;
  std::vector<std::string_view> fields;
  std::string order;  // the header's order, else the usual order
};

std::optional<FirstEvent> firstEventOf(std::string_view beginning) {
  if (beginning.find('\0') != std::string_view::npos) return std::nullopt;
  EventColumns columns;
  Header ignored;
  std::string_view rest = takeHeader(beginning, columns, ignored);
  FirstEvent first;
  if (rest.empty()) return std::nullopt;
  const std::string_view before = beginning.substr(0, beginning.size() - rest.size());
  first.line = 1 + static_cast<std::uint64_t>(std::count(before.begin(), before.end(), '\n'));
  first.text = trimmed(takeLine(rest));
  first.fields = eventFields(first.text, separatorOf(first.text));
  first.order = columns.order;
  return first;
}

/// Returns whether the numbers between blanks or semicolons have decimal commas.
bool hasDecimalCommas(std::string_view line) {
  const std::vector<std::string_view> fields = splitWords(line, " \t;");
  bool any = false;
  for (const std::string_view field : fields) {
    std::string number(field);
    const std::size_t comma = number.find(',');
    const bool decimal = comma != std::string::npos && comma + 1 < number.size();
    if (decimal) number[comma] = '.';
    any = any || decimal;
    if (!numberOf(number)) return false;
  }
  return any && fields.size() >= 4;
}

}  // namespace

std::vector<std::string_view> eventFields(std::string_view line, char separator) {
  return separator == ' ' ? splitWords(line) : splitFields(line, {&separator, 1});
}

EventColumns findEventColumns(std::string_view beginning, const ReaderOptions& options,
                              const std::string& file) {
  constexpr int kUnknown = 1;
  EventColumns columns;
  columns.time_exponent = kUnknown;
  Header header;
  std::string_view rest = takeHeader(beginning, columns, header);
  TextRows rows;
  for (std::size_t k = 0; k < kSampledLines && !rest.empty(); ++k) {
    const std::string_view line = trimmed(takeLine(rest));
    if (k == 0) columns.separator = separatorOf(line);
    rows.push_back(eventFields(line.substr(0, line.find('#')), columns.separator));
  }
  if (!options.columns.empty() || !header.named) {
    columns.order = findColumnOrder(numbersOf(rows), options, file, columns.warnings);
    if (options.columns.empty()) warnOfHeader(rows, header, file, columns);
  }
  if (!options.time_unit.empty()) columns.time_exponent = *timeExponentOf(options.time_unit);
  if (columns.time_exponent == kUnknown) {
    TimeUnit unit = findTimeUnit(options, timesIn(rows, columns), kUsualEventRate, file);
    columns.time_exponent = unit.exponent;
    if (unit.warning) columns.warnings.push_back(std::move(*unit.warning));
  }
  return columns;
}

bool looksLikeEventLines(std::string_view beginning, const std::string& option) {
  const std::optional<FirstEvent> first = firstEventOf(beginning);
  if (!first) return false;
  const std::size_t count = first->fields.size();
  std::string order = first->order;
  if (!option.empty() && option.find('=') == std::string::npos) {
    order = orderOfOption(option);
  } else if (count == 4 && order.size() != 4) {
    order = "txyp";
  } else if (count == 8) {
    return false;  // a pose
  }
  if (count != order.size()) return false;
  for (std::size_t k = 0; k < count; ++k) {
    const bool any = order[k] == 'c' || (order[k] == '-' && !option.empty());
    if (!any && !numberOf(first->fields[k])) return false;
  }
  return true;
}

std::optional<std::string> whyNoEventLines(std::string_view beginning) {
  const std::optional<FirstEvent> first = firstEventOf(beginning);
  if (!first) return std::nullopt;
  const auto why = [&](const std::string& what) {
    return fmt::format("{}: {}: {}", first->line, inQuotes(first->text), what);
  };
  if (hasDecimalCommas(first->text)) {
    return why("decimal commas: expected decimal points (tr , . <FILE >NEW)");
  }
  const std::size_t count = first->fields.size();
  const auto numbers =
      std::count_if(first->fields.begin(), first->fields.end(),
                    [](std::string_view field) { return numberOf(field).has_value(); });
  if (2 * static_cast<std::size_t>(numbers) < count) return std::nullopt;  // prose
  if (count == 12) return why(kPosesWithoutTimes);
  if (count != first->order.size()) {
    return why(fmt::format(
        "expected {} fields, {}, not {} (other columns: --event-columns, - for one to ignore)",
        first->order.size(), asWords(first->order), count));
  }
  for (std::size_t k = 0; k < count; ++k) {
    const std::string_view field = first->fields[k];
    if (numberOf(field) || first->order[k] == 'c') continue;
    return why(fmt::format("{} = {}: expected {}", first->order[k], inQuotes(field),
                           first->order[k] == 'p' ? kExpectedPolarity : "a number"));
  }
  return std::nullopt;
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
