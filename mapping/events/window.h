// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

namespace efm {

/// The interval [t0, t1) of a keyframe's events, and the time of its reference view.
struct Window {
  std::int64_t t0_ns = 0;
  std::int64_t t1_ns = 0;
  std::int64_t t_ref_ns = 0;

  bool contains(std::int64_t t_ns) const { return t_ns >= t0_ns && t_ns < t1_ns; }
};

/// Half-open [t0, t1) on the trajectory's clock; not given: no limit.
struct TimeLimits {
  std::optional<std::int64_t> t0_ns;
  std::optional<std::int64_t> t1_ns;

  bool contain(std::int64_t t_ns) const {
    return (!t0_ns || t_ns >= *t0_ns) && (!t1_ns || t_ns < *t1_ns);
  }
  /// @throws std::invalid_argument where t1 is not after t0.
  void validate() const;
};

}  // namespace efm
