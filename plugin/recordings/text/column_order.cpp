// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/text/event_columns.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace efm {
namespace {

constexpr std::size_t kColumns = 4;

/// The values of a column.
struct ColumnValues {
  bool whole = true;
  double min = std::numeric_limits<double>::infinity();
  double max = -min;
  double max_drop = 0;  // below an earlier value
  bool has_zero = false;
  bool has_one = false;
  bool has_minus_one = false;
  bool has_others = false;

  void add(double value) {
    whole = whole && std::floor(value) == value;
    min = std::min(min, value);
    max = std::max(max, value);
    max_drop = std::max(max_drop, max - value);
    has_zero |= value == 0;
    has_one |= value == 1;
    has_minus_one |= value == -1;
    has_others |= value != 0 && value != 1 && value != -1;
  }
  /// A time comes late now and then. Pixels come and go over the whole image.
  bool rises() const { return max > min && max_drop <= 0.1 * (max - min); }
  bool mayBeTime() const { return rises() || max == min || !whole; }
  bool mayBePolarity() const { return whole && !has_others && !(has_zero && has_minus_one); }
  bool hasBothPolarities() const { return has_one && (has_zero || has_minus_one); }
  bool mayBePixel() const { return whole && min >= 0 && max <= 65'535; }
};

using AllValues = std::array<ColumnValues, kColumns>;

/// @return the number of rows.
std::size_t addRows(const EventRows& rows, AllValues& columns) {
  std::size_t count = 0;
  for (const std::vector<double>& row : rows) {
    if (row.size() != kColumns) continue;
    for (std::size_t k = 0; k < kColumns; ++k) columns[k].add(row[k]);
    ++count;
  }
  return count;
}

/// @param strict whether the time must rise, and the pixels must differ.
bool isPossible(const AllValues& columns, const std::string& order, bool strict) {
  for (std::size_t k = 0; k < kColumns; ++k) {
    const ColumnValues& values = columns[k];
    const bool varies = values.max - values.min >= 2;
    if (order[k] == 't' && !(strict ? values.rises() : values.mayBeTime())) return false;
    if (order[k] == 'p' && !values.mayBePolarity()) return false;
    const bool is_pixel = order[k] == 'x' || order[k] == 'y';
    if (is_pixel && !(values.mayBePixel() && (varies || !strict))) return false;
  }
  return true;
}

std::vector<std::string> allOrders() {
  std::vector<std::string> orders;
  std::string order = "ptxy";  // sorted
  do {
    if (order.find('x') < order.find('y')) orders.push_back(order);
  } while (std::next_permutation(order.begin(), order.end()));
  return orders;
}

}  // namespace

std::optional<ColumnOrder> orderOfValues(const EventRows& rows, const std::string& expected) {
  constexpr std::size_t kFew = 10;    // say nothing
  constexpr std::size_t kMany = 100;  // leave no doubt
  AllValues columns;
  const std::size_t count = addRows(rows, columns);
  if (count < kFew) return std::nullopt;
  if (expected.size() == kColumns && isPossible(columns, expected, false)) {
    return ColumnOrder{expected, true};
  }
  std::optional<ColumnOrder> found;
  for (const std::string& order : allOrders()) {
    if (!isPossible(columns, order, true)) continue;
    if (found) return std::nullopt;
    const ColumnValues& polarity = columns[order.find('p')];
    found = ColumnOrder{order, count >= kMany && polarity.hasBothPolarities()};
  }
  return found;
}

}  // namespace efm
