// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

namespace efm {

/// A text without the mark of UTF-8 that some editors put at its beginning.
inline std::string_view withoutByteOrderMark(std::string_view text) {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  if (text.substr(0, kMark.size()) == kMark) text.remove_prefix(kMark.size());
  return text;
}

}  // namespace efm
