// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

namespace efm {

/// The errors of an evaluation, as --json prints them. Tables show their numbers.
using EvaluationJson = nlohmann::ordered_json;

inline std::string jsonText(const EvaluationJson& json) {
  return json.dump(2, ' ', false, EvaluationJson::error_handler_t::replace) + "\n";
}

/// A column of a table: the values of one key. Numbers are multiplied by a factor.
struct TableColumn {
  const char* name;
  const char* key;
  int decimals = 0;
  double factor = 1;

  /// Returns the text of the object's value, "-" if the object does not have the key.
  std::string textIn(const EvaluationJson& object) const {
    const auto found = object.find(key);
    if (found == object.end()) return "-";
    return found->is_string() ? std::string(*found)
                              : fmt::format("{:.{}f}", factor * double(*found), decimals);
  }
};

using TableRow = std::vector<std::string>;

/// Returns a table as plain text, with two blanks between columns and no blanks at the end of a
/// line. The first column is aligned left, the other columns right. Missing cells stay empty.
inline std::string tableText(const std::vector<TableRow>& rows) {
  std::vector<std::size_t> widths;
  for (const TableRow& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  std::string text;
  for (const TableRow& row : rows) {
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

/// Returns a heading and then a row per object of a list.
inline std::vector<TableRow> tableRows(const std::vector<TableColumn>& columns,
                                       const EvaluationJson& objects) {
  std::vector<TableRow> rows(1 + objects.size());
  for (const TableColumn& column : columns) {
    rows[0].emplace_back(column.name);
    for (std::size_t i = 0; i < objects.size(); ++i) {
      rows[i + 1].push_back(column.textIn(objects[i]));
    }
  }
  return rows;
}

}  // namespace efm
