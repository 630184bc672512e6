// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace efm::bench {

/// A measured or derived number. Its name contains the unit: "cpu_ms", "votes/s", "times_plain".
struct Quantity {
  std::string name;
  double value = 0;
};

/// The results of a case.
struct PerformanceRow {
  std::string group;   ///< "voting", "keyframe", …
  std::string name;    ///< Size or variant: "346x260".
  std::string kernel;  ///< Empty without a kernel.
  int threads = 1;
  std::vector<Quantity> quantities;

  std::optional<double> find(std::string_view quantity) const {
    for (const Quantity& q : quantities) {
      if (q.name == quantity) return q.value;
    }
    return std::nullopt;
  }
};

}  // namespace efm::bench
