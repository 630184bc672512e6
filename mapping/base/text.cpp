// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/base/text.h"

#include <algorithm>

namespace efm {

std::string printable(std::string_view text, std::size_t max_characters) {
  constexpr std::string_view kHexDigits = "0123456789abcdef";
  std::string shown;
  for (const char c : text.substr(0, max_characters)) {
    if (c >= ' ' && c <= '~') {
      shown += c;
    } else {
      const auto byte = static_cast<unsigned char>(c);
      shown += "\\x";
      shown += kHexDigits[byte >> 4U];
      shown += kHexDigits[byte & 0xfU];
    }
  }
  return text.size() > max_characters ? shown + "…" : shown;
}

std::string inQuotes(std::string_view text) { return "'" + printable(text) + "'"; }

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::string_view takeLine(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

std::vector<std::string_view> splitFields(std::string_view line, std::string_view separators) {
  std::vector<std::string_view> fields;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find_first_of(separators, begin), line.size());
    fields.push_back(trimmed(line.substr(begin, end - begin)));
    begin = end + 1;
  }
  if (fields.back().empty()) fields.pop_back();
  return fields;
}

std::vector<std::string_view> splitWords(std::string_view text, std::string_view blanks) {
  std::vector<std::string_view> words;
  for (std::size_t begin = text.find_first_not_of(blanks); begin != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(blanks, begin), text.size());
    words.push_back(text.substr(begin, end - begin));
    begin = text.find_first_not_of(blanks, end);
  }
  return words;
}

}  // namespace efm
