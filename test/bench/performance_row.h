// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace efm::bench {

/// A measured or derived number; its name says the unit: "cpu_ms", "votes/s", "times_plain".
struct Quantity {
  std::string name;
  double value = 0;
};

/// What was measured of one case.
struct PerformanceRow {
  std::string group;   ///< What is measured: "voting", "keyframe", …
  std::string name;    ///< Its size or variant: "346x260".
  std::string kernel;  ///< Empty where none runs.
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
