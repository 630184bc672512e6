// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/text_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

namespace efm {

std::string TextTable::text() const {
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

std::string fixedText(double value, int decimals) {
  return fmt::format("{:.{}f}", value, decimals);
}

}  // namespace efm
