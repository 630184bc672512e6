// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string_view>

#include "mapping/base/number_text.h"

namespace efm {

/// Refuses an option whose value is out of range.
/// @param holds the condition of a valid value, so that NaN is refused too.
/// @throws std::invalid_argument "key = value: must be expected".
template <typename Value>
void requireOption(bool holds, std::string_view key, const Value& value,
                   std::string_view expected) {
  if (holds) return;
  NumberText message(15);  // as typed: 0.1, not 0.10000000000000001
  message << key << " = " << value << ": must be " << expected;
  throw std::invalid_argument(message.str());
}

}  // namespace efm
