// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

namespace efm {

/// The maximum of a sequence that a few outliers don't move: its 95th percentile (nearest rank),
/// which is the plain maximum of fewer than twenty values.
class RobustMaximum {
 public:
  /// @param value finite. Cost: linear in the number of values, 8 bytes each.
  void take(double value);
  /// Nothing before the first value.
  std::optional<double> value() const;

 private:
  std::vector<double> values_;  // in increasing order
};

}  // namespace efm
