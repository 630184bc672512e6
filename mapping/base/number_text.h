// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <locale>
#include <sstream>

namespace efm {

/// Makes text of numbers. Other streams follow the locale of the host program, which may group
/// digits (1.500) or write decimal commas.
class NumberText : public std::ostringstream {
 public:
  /// @param digits significant ones: 17 are all of a double.
  explicit NumberText(int digits = 17) {
    imbue(std::locale::classic());
    precision(digits);
  }
};

}  // namespace efm
