// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace efm {

/// The numbers of some events, a number per column.
using EventRows = std::vector<std::vector<double>>;

/// An order of the columns t, x, y and p, a letter per column.
struct ColumnOrder {
  std::string order;
  /// Whether the values leave no other order, but for x and y: they cannot be told apart, and x is
  /// the first of them. Few lines, or events of one polarity, leave doubts.
  bool certain = false;
};

/// The order of four columns as their values show it: times rise, the polarity has the values 0 and
/// 1 or -1 and 1, pixels are whole numbers that come and go. An order that is expected and possible
/// comes before all others.
/// @param rows of which those without four numbers are ignored.
/// @return nothing where the values show no order, or several.
std::optional<ColumnOrder> orderOfValues(const EventRows& rows, const std::string& expected);

}  // namespace efm
