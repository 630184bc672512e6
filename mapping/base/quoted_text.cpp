// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/base/quoted_text.h"

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

}  // namespace efm
