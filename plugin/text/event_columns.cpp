// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/text/event_columns.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "mapping/options/quoted_text.h"
#include "mapping/options/text_parsing.h"
#include "plugin/streams/time_unit.h"

namespace efm {
namespace {

constexpr std::size_t kSampledLines = 1000;

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
  if (word.isTime()) return 't';
  if (word.name == "x" || word.name == "y") return word.name[0];
  for (const char* name : {"p", "pol", "polarity", "on"}) {
    if (word.name == name) return 'p';
  }
  return '-';
}

bool isComplete(const std::string& order) {
  return std::all_of(std::begin("txyp"), std::end("txyp") - 1, [&](char column) {
    return std::count(order.begin(), order.end(), column) == 1;
  });
}

/// Takes order and unit from a line of names; leaves both where it names no event.
void takeNames(std::string_view line, EventColumns& columns) {
  if (!line.empty() && line.front() == '#') line = trimmed(line.substr(1));
  std::string order;
  std::optional<int> exponent;
  for (const std::string_view field : eventFields(line, separatorOf(line))) {
    const HeaderWord word = headerWord(field);
    order += columnOf(word);
    if (order.back() == 't') exponent = word.time_exponent;
  }
  if (!isComplete(order)) return;
  columns.order = order;
  if (exponent) columns.time_exponent = *exponent;
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
std::string_view takeHeader(std::string_view text, EventColumns& columns) {
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
    if (!size) takeNames(line, columns);
    columns.header_lines = lines;
  }
  return {};
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
  std::string_view rest = takeHeader(beginning, columns);
  if (!options.columns.empty()) columns.order = orderOfOption(options.columns);
  if (!options.time_unit.empty()) columns.time_exponent = *timeExponentOf(options.time_unit);

  const std::size_t t_column = columns.order.find('t');
  TimeSample sample;
  for (std::size_t k = 0; k < kSampledLines && !rest.empty(); ++k) {
    const std::string_view line = takeTextLine(rest);
    if (k == 0) columns.separator = separatorOf(line);
    const std::vector<std::string_view> fields = eventFields(line, columns.separator);
    if (fields.size() != columns.order.size()) continue;
    const std::optional<double> t = parseFinite(fields[t_column]);
    if (!t) continue;
    ++sample.count;
    sample.whole = sample.whole && fields[t_column].find_first_of(".eE") == std::string_view::npos;
    sample.max = std::max(sample.max, std::abs(*t));
  }
  if (columns.time_exponent == kUnknown)
    columns.time_exponent = timeExponent(options, sample, file);
  return columns;
}

bool looksLikeEventLines(std::string_view beginning) {
  if (beginning.find('\0') != std::string_view::npos) return false;
  EventColumns columns;
  std::string_view rest = takeHeader(beginning, columns);
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
