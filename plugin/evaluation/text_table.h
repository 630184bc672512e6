// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace efm {

/// A table for people: columns as wide as they need, the first from the left, the others from the
/// right.
class TextTable {
 public:
  /// @param row of any number of cells; what is missing stays empty.
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }

  /// The lines, two blanks between columns and none at their ends.
  std::string text() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// A number with so many decimals.
std::string fixedText(double value, int decimals);

}  // namespace efm
