// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace efm {

/// A table as plain text. The first column is aligned left, the others right.
class TextTable {
 public:
  /// @param row of any number of cells. Missing cells stay empty.
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }

  /// The lines, with two blanks between columns and none at the end of a line.
  std::string text() const {
    std::vector<std::size_t> widths;
    for (const auto& row : rows_) {
      widths.resize(std::max(widths.size(), row.size()));
      for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
    }
    std::string text;
    for (const auto& row : rows_) {
      std::string line;
      for (std::size_t c = 0; c < row.size(); ++c) {
        const std::string blanks(widths[c] - row[c].size(), ' ');
        line += c == 0 ? row[c] + blanks : "  " + blanks + row[c];
      }
      line.erase(line.find_last_not_of(' ') + 1);
      text += line + "\n";
    }
    return text;
  }

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// A number with this number of decimals.
inline std::string fixedText(double value, int decimals) {
  return fmt::format("{:.{}f}", value, decimals);
}

}  // namespace efm
