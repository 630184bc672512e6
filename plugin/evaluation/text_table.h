// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace efm {

/// A table as plain text. The first column is aligned left, the others right.
class TextTable {
 public:
  /// @param row of any number of cells. Missing cells stay empty.
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }

  /// The lines, with two blanks between columns and none at the end of a line.
  std::string text() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// A number with this number of decimals.
std::string fixedText(double value, int decimals);

}  // namespace efm
