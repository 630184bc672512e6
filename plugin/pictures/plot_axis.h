// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace efm {

enum class AxisScale {
  kLinear,
  kLogarithmic,  ///< Values must be above 0; others have no place.
};

/// What an axis spans. Invariant for those that `rangeAround` makes: from < to, both finite, and
/// above 0 on a logarithmic axis.
struct AxisRange {
  double from = 0;
  double to = 1;
  AxisScale scale = AxisScale::kLinear;

  /// How far along the axis a value lies: 0 at `from`, 1 at `to`, beyond them outside. NaN for what
  /// has no place on the axis.
  double shareAlong(double value) const;
};

/// The range that holds all values that have a place on such an axis, with a margin of 4 % of its
/// length on both sides; something sensible around 0 or 1 where there is no value or one alone.
AxisRange rangeAround(const std::vector<double>& values, AxisScale scale);

/// A mark on an axis.
struct AxisTick {
  double value = 0;
  std::string text;
};

/// Round values inside the range: 1, 2 or 5 times a power of ten apart; on a logarithmic axis the
/// powers of ten, with 2 and 5 between them where they are few, or evenly apart where even so there
/// are hardly any.
/// @param at_most how many, at least 2; a logarithmic axis may need one or two more.
std::vector<AxisTick> ticksOf(const AxisRange& range, int at_most);

}  // namespace efm
