// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/streams/time_unit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <stdexcept>

#include "mapping/geometry/timestamp.h"
#include "mapping/options/text_parsing.h"

namespace efm {

std::optional<int> timeExponentOf(std::string_view unit) {
  constexpr struct {
    std::string_view name;
    int exponent;
  } kUnits[] = {{"s", 0},   {"sec", 0}, {"seconds", 0}, {"ms", -3}, {"msec", -3}, {"us", -6},
                {"µs", -6}, {"μs", -6}, {"usec", -6},   {"ns", -9}, {"nsec", -9}};
  for (const auto& [name, exponent] : kUnits) {
    if (unit == name) return exponent;
  }
  return std::nullopt;
}

int timeExponent(const ReaderOptions& options, const TimeSample& sample, const std::string& where) {
  constexpr int kEnough = 10;
  constexpr double kEndOfTimeUs = static_cast<double>(kEndOfTimeNs) * 1e-3;
  if (!options.time_unit.empty()) return timeExponentOf(options.time_unit).value_or(0);
  if (sample.max >= kEndOfTimeUs) return -9;
  if (!sample.whole || sample.count < kEnough) return 0;
  throw std::runtime_error(
      fmt::format("{}: all times are whole numbers, of an unknown unit: expected decimal seconds, "
                  "or --time-unit s, ms, us or ns",
                  where));
}

bool HeaderWord::isTime() const {
  constexpr std::string_view kNames[] = {"t",         "ts",         "time",  "times",
                                         "timestamp", "timestamps", "stamp", "time_stamp"};
  return std::find(std::begin(kNames), std::end(kNames), name) != std::end(kNames);
}

HeaderWord headerWord(std::string_view text) {
  std::string lower;
  for (const char c : text) {
    if (c != '"' && c != '\'' && c != '#') {
      lower += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  HeaderWord word;
  const std::string_view content = trimmed(lower);
  const std::size_t bracket = content.find_first_of("[(");
  word.name = std::string(trimmed(content.substr(0, bracket)));
  if (bracket != std::string_view::npos) {
    const std::size_t end = content.find_first_of("])", bracket);
    const std::size_t length = std::min(end, content.size()) - bracket - 1;
    word.time_exponent = timeExponentOf(trimmed(content.substr(bracket + 1, length)));
    return word;
  }
  const std::size_t underscore = word.name.rfind('_');
  if (underscore != std::string::npos) {
    word.time_exponent = timeExponentOf(std::string_view(word.name).substr(underscore + 1));
    if (word.time_exponent) word.name.resize(underscore);
  }
  return word;
}

}  // namespace efm
