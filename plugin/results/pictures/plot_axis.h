// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace efm {

enum class AxisScale {
  kLinear,
  kLogarithmic,  ///< Shows values above 0 only.
  kInverse,      ///< Linear in 1 / value: for depth. Shows values above 0 only.
};

/// The interval of an axis. `rangeAround` ensures that both ends are finite, that from < to, and
/// that both are above 0 on a logarithmic or inverse axis.
struct AxisRange {
  double from = 0;
  double to = 1;
  AxisScale scale = AxisScale::kLinear;

  /// The position of a value on the axis: 0 at `from`, 1 at `to`. NaN if the axis cannot show
  /// the value.
  double fractionAlong(double value) const;
};

/// The range of all values that an axis of this scale can show, with a margin of 4 % of its length
/// at both ends (of its logarithm unless it is linear). Without a value: a range around 0, or
/// around
/// 1. With one
/// value: a range around it.
AxisRange rangeAround(const std::vector<double>& values, AxisScale scale);

/// A mark on an axis.
struct AxisTick {
  double value = 0;
  std::string text;
};

/// Round values inside the range. On a linear axis their spacing is 1, 2 or 5 times a power of ten.
/// On a logarithmic axis they are the powers of ten; if these are few, also 2 and 5 times them; if
/// even these are fewer than three, the ticks of a linear axis. On an inverse axis the roundest
/// values that have space.
/// @param max_ticks at least 2. A logarithmic axis may have one or two more.
std::vector<AxisTick> ticksOf(const AxisRange& range, int max_ticks);

}  // namespace efm
