// SPDX-License-Identifier: BSD-3-Clause
#include "test/bench/performance_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

namespace efm::bench {
namespace {

/// The names of all quantities, in order of their first use.
std::vector<std::string> columnsOf(const std::vector<PerformanceRow>& rows) {
  std::vector<std::string> columns;
  for (const PerformanceRow& row : rows) {
    for (const Quantity& quantity : row.quantities) {
      if (std::find(columns.begin(), columns.end(), quantity.name) == columns.end()) {
        columns.push_back(quantity.name);
      }
    }
  }
  return columns;
}

std::string printed(const char* format, double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

/// Four digits, with M for millions and G for billions.
std::string readable(double value) {
  constexpr double kMillion = 1e6;
  constexpr double kBillion = 1e9;
  if (std::abs(value) >= kBillion) return printed("%.4g G", value / kBillion);
  if (std::abs(value) >= kMillion) return printed("%.4g M", value / kMillion);
  if (std::abs(value) >= 1000) return printed("%.0f", value);
  return printed("%.4g", value);
}

/// A field in the format of RFC 4180.
std::string csvField(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

std::vector<std::string> groupsOf(const std::vector<PerformanceRow>& rows) {
  std::vector<std::string> groups;
  for (const PerformanceRow& row : rows) {
    if (std::find(groups.begin(), groups.end(), row.group) == groups.end()) {
      groups.push_back(row.group);
    }
  }
  return groups;
}

}  // namespace

void writeCsv(std::ostream& out, const std::vector<PerformanceRow>& rows,
              const Conditions& conditions) {
  const std::vector<std::string> columns = columnsOf(rows);
  out << "group,case,kernel,threads";
  for (const std::string& column : columns) out << ',' << csvField(column);
  for (const auto& [name, text] : conditions) out << ',' << csvField(name);
  out << '\n';
  for (const PerformanceRow& row : rows) {
    out << csvField(row.group) << ',' << csvField(row.name) << ',' << csvField(row.kernel) << ','
        << row.threads;
    for (const std::string& column : columns) {
      const auto value = row.find(column);
      out << ',' << (value ? printed("%.6g", *value) : "");
    }
    for (const auto& [name, text] : conditions) out << ',' << csvField(text);
    out << '\n';
  }
}

void writeMarkdown(std::ostream& out, const std::vector<PerformanceRow>& rows,
                   const Conditions& conditions) {
  out << "# Performance\n\n";
  for (const auto& [name, text] : conditions) out << "- " << name << ": " << text << '\n';
  for (const std::string& group : groupsOf(rows)) {
    std::vector<PerformanceRow> members;
    std::copy_if(rows.begin(), rows.end(), std::back_inserter(members),
                 [&](const PerformanceRow& row) { return row.group == group; });
    const std::vector<std::string> columns = columnsOf(members);
    out << "\n## " << group << "\n\n| case | kernel | threads |";
    for (const std::string& column : columns) out << ' ' << column << " |";
    out << "\n|---|---|---|";
    for (std::size_t i = 0; i < columns.size(); ++i) out << "---|";
    out << '\n';
    for (const PerformanceRow& row : members) {
      out << "| " << row.name << " | " << row.kernel << " | " << row.threads << " |";
      for (const std::string& column : columns) {
        const auto value = row.find(column);
        out << ' ' << (value ? readable(*value) : "") << " |";
      }
      out << '\n';
    }
  }
}

}  // namespace efm::bench
