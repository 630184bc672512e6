// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/text/event_columns.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "mapping/options/quoted_text.h"
#include "mapping/options/text_parsing.h"
#include "plugin/streams/time_unit.h"
#include "plugin/text/column_order.h"

namespace efm {
namespace {

constexpr std::size_t kSampledLines = 5000;

std::string_view takeTextLine(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = trimmed(text.substr(0, end));
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

char separatorOf(std::string_view line) {
  const std::size_t found = line.find_first_of(",;");
  return found == std::string_view::npos ? ' ' : line[found];
}

bool hasNumber(const std::vector<std::string_view>& fields) {
  return std::any_of(fields.begin(), fields.end(),
                     [](std::string_view field) { return parseNumber<double>(field).has_value(); });
}

char columnOf(const HeaderWord& word) {
  constexpr struct {
    char column;
    std::string_view names;  // between blanks
  } kNames[] = {{'x',
                 " x u col column x_pos pos_x xpos posx x_px px_x pixel_x x_pixel x_coord coord_x "
                 "x_coordinate x_addr "},
                {'y',
                 " y v row y_pos pos_y ypos posy y_px px_y pixel_y y_pixel y_coord coord_y "
                 "y_coordinate y_addr "},
                {'p', " p pol pols polarity polarities on on_off sign "}};
  if (word.isTime()) return 't';
  for (const auto& [column, names] : kNames) {
    const std::string name = " " + word.name + " ";
    if (names.find(name) != std::string_view::npos) return column;
  }
  return '-';
}

bool isComplete(const std::string& order) {
  return std::all_of(std::begin("txyp"), std::end("txyp") - 1, [&](char column) {
    return std::count(order.begin(), order.end(), column) == 1;
  });
}

/// The lines before the first event.
struct Header {
  bool named = false;               // it names the columns
  std::string_view not_understood;  // a line of words
};

/// Takes order and unit from a line of names; leaves both where it names no event.
/// @return whether it does.
bool takeNames(std::string_view line, EventColumns& columns) {
  if (!line.empty() && line.front() == '#') line = trimmed(line.substr(1));
  std::string order;
  std::optional<int> exponent;
  for (const std::string_view field : eventFields(line, separatorOf(line))) {
    const HeaderWord word = headerWord(field);
    order += columnOf(word);
    if (order.back() == 't') exponent = word.time_exponent;
  }
  if (!isComplete(order)) return false;
  columns.order = order;
  if (exponent) columns.time_exponent = *exponent;
  return true;
}

std::string orderOfOption(const std::string& text) {
  std::string order;
  for (const std::string_view word : splitWords(text, " ,")) order += word;
  if (isComplete(order) && order.find_first_not_of("txyp-") == std::string::npos) return order;
  throw std::runtime_error(fmt::format(
      "--event-columns {}: expected t, x, y and p, each once, and - for a column to ignore",
      inQuotes(text)));
}

std::optional<CameraSize> sizeIn(const std::vector<std::string_view>& fields) {
  if (fields.size() != 2) return std::nullopt;
  const auto width = parseNumber<std::uint16_t>(fields[0]);
  const auto height = parseNumber<std::uint16_t>(fields[1]);
  if (!width || !height || *width == 0 || *height == 0) return std::nullopt;
  return CameraSize{*width, *height};
}

/// Skips the lines before the first event. @return the rest of the text.
std::string_view takeHeader(std::string_view text, EventColumns& columns, Header& header) {
  for (std::uint64_t lines = 0; !text.empty();) {
    const std::string_view rest = text;
    const std::string_view line = takeTextLine(text);
    ++lines;
    const bool comment = !line.empty() && line.front() == '#';
    const std::vector<std::string_view> fields = eventFields(line, separatorOf(line));
    if (line.empty()) continue;
    const std::optional<CameraSize> size = comment ? std::nullopt : sizeIn(fields);
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

std::string asWords(const std::string& order) {
  std::string words;
  for (const char column : order) words += (words.empty() ? "" : " ") + std::string(1, column);
  return words;
}

/// @throws std::runtime_error where the values show another order than the usual one, but not
/// surely.
void takeOrderOfValues(const EventRows& rows, const Header& header, const std::string& file,
                       EventColumns& columns) {
  const std::optional<ColumnOrder> found = orderOfValues(rows, columns.order);
  const bool usual = !found || found->order == columns.order;
  const std::string words = asWords(found ? found->order : columns.order);
  if (!usual && !found->certain) {
    throw std::runtime_error(
        fmt::format("{}: by their values, the columns are probably {}: expected {}, a header with "
                    "their names, or --event-columns \"{}\"",
                    file, words, asWords(columns.order), words));
  }
  if (found) columns.order = found->order;
  const bool misread = !header.not_understood.empty() && !rows.empty() &&
                       rows.front().size() == columns.order.size();
  if (usual && !misread) return;
  columns.warnings.push_back(
      {"event-columns",
       misread ? fmt::format("{}: the header {} is not understood: the columns are read as {} "
                             "(--event-columns \"{}\")",
                             file, inQuotes(header.not_understood), words, words)
               : fmt::format("{}: by their values, the columns are {} (--event-columns \"{}\")",
                             file, words, words)});
}

/// @throws std::runtime_error where the values show another order than that of the option.
void refuseOtherOrder(const EventRows& rows, const std::string& option, const std::string& file,
                      const std::string& order) {
  const std::optional<ColumnOrder> found = orderOfValues(rows, order);
  if (!found || !found->certain || found->order == order) return;
  throw std::runtime_error(
      fmt::format("--event-columns {}: the columns of {} are {} by their values", inQuotes(option),
                  file, asWords(found->order)));
}

TimeSample timesIn(const EventRows& rows, const EventColumns& columns) {
  const std::size_t t_column = columns.order.find('t');
  TimeSample sample;
  for (const std::vector<std::string_view>& row : rows) {
    if (row.size() != columns.order.size()) continue;
    const std::string_view text = row[t_column];
    const std::optional<double> t = parseFinite(text);
    if (t) sample.add(*t, text.find_first_of(".eE") == std::string_view::npos);
  }
  return sample;
}

}  // namespace

std::vector<std::string_view> eventFields(std::string_view line, char separator) {
  if (separator == ' ') return splitWords(line);
  std::vector<std::string_view> fields;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(separator, begin), line.size());
    fields.push_back(trimmed(line.substr(begin, end - begin)));
    begin = end + 1;
  }
  if (fields.back().empty()) fields.pop_back();  // an empty line, a separator at the end
  return fields;
}

EventColumns findEventColumns(std::string_view beginning, const ReaderOptions& options,
                              const std::string& file) {
  constexpr int kUnknown = 1;
  EventColumns columns;
  columns.time_exponent = kUnknown;
  Header header;
  std::string_view rest = takeHeader(beginning, columns, header);
  EventRows rows;
  for (std::size_t k = 0; k < kSampledLines && !rest.empty(); ++k) {
    const std::string_view line = takeTextLine(rest);
    if (k == 0) columns.separator = separatorOf(line);
    rows.push_back(eventFields(line.substr(0, line.find('#')), columns.separator));
  }
  if (!options.columns.empty()) {
    columns.order = orderOfOption(options.columns);
    refuseOtherOrder(rows, options.columns, file, columns.order);
  } else if (!header.named) {
    takeOrderOfValues(rows, header, file, columns);
  }
  if (!options.time_unit.empty()) columns.time_exponent = *timeExponentOf(options.time_unit);
  if (columns.time_exponent == kUnknown) {
    TimeUnit unit = findTimeUnit(options, timesIn(rows, columns), kUsualEventRate, file);
    columns.time_exponent = unit.exponent;
    if (unit.warning) columns.warnings.push_back(std::move(*unit.warning));
  }
  return columns;
}

bool looksLikeEventLines(std::string_view beginning) {
  if (beginning.find('\0') != std::string_view::npos) return false;
  EventColumns columns;
  Header ignored;
  std::string_view rest = takeHeader(beginning, columns, ignored);
  if (rest.empty()) return false;
  const std::string_view line = takeTextLine(rest);
  const std::vector<std::string_view> fields = eventFields(line, separatorOf(line));
  const bool numbers = std::all_of(fields.begin(), fields.end(), [](std::string_view field) {
    return parseFinite(field).has_value();
  });
  return numbers && fields.size() >= 4 && fields.size() != 8 &&
         (fields.size() == 4 || columns.order.size() == fields.size());
}

}  // namespace efm
