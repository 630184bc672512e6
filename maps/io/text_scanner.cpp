// SPDX-License-Identifier: BSD-3-Clause
#include "maps/io/text_scanner.h"

#include <optional>
#include <stdexcept>

#include "mapping/base/text.h"

namespace efm {

std::string_view TextScanner::line(std::string_view expected) {
  const std::size_t end = rest_.find('\n');
  if (end == std::string_view::npos) {
    const std::string place = "line " + std::to_string(lines_ + 1) + ": ";
    throw std::runtime_error(
        place + (rest_.empty() ? "the file ends" : inQuotes(rest_) + ", then the file ends") +
        ": expected " + std::string(expected) +
        (rest_.empty() ? "" : " and the end of the line: is the file cut short?"));
  }
  ++lines_;
  std::string_view line = take(end + 1);
  line.remove_suffix(1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

std::string_view TextScanner::take(std::size_t bytes) {
  const std::string_view taken = rest_.substr(0, bytes);
  rest_.remove_prefix(taken.size());
  return taken;
}

void TextScanner::refuse(const std::string& why) const {
  throw std::runtime_error("byte " + std::to_string(bytes_.size() - rest_.size()) + ": " + why);
}

void TextScanner::expectEnd() const {
  if (rest_.find_first_not_of(" \t\r\n") == std::string_view::npos) return;
  refuse(std::to_string(rest_.size()) + " more bytes: expected the end of the file");
}

void WordLine::refuse(const std::string& why) const {
  throw std::runtime_error("line " + std::to_string(number) + ": " + why);
}

std::uint64_t WordLine::count(std::size_t word) const {
  const std::string_view text = word < words.size() ? words[word] : std::string_view{};
  const std::optional<std::uint64_t> count = parseNumber<std::uint64_t>(text);
  if (!count) refuse(inQuotes(text) + ": expected a whole number from 0 on");
  return *count;
}

WordLine wordLine(TextScanner& scanner, std::string_view expected) {
  const std::string_view text = scanner.line(expected);
  return {scanner.lineNumber(), splitWords(text, " \t")};
}

}  // namespace efm
