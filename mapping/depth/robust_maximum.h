// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

namespace efm {

/// A maximum that is robust to a few outliers: the 95th percentile (nearest rank). Of fewer than
/// twenty values it is the maximum itself.
class RobustMaximum {
 public:
  /// @param value finite. Cost: linear in the number of values, 8 bytes each.
  void add(double value);
  /// Nothing before the first value.
  std::optional<double> value() const;

 private:
  std::vector<double> values_;  // in increasing order
};

}  // namespace efm
