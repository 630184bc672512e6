// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace efm {

/// The events of a keyframe, [t0, t1), and the time of its reference view.
struct Window {
  std::int64_t t0_ns = 0;
  std::int64_t t1_ns = 0;
  std::int64_t t_ref_ns = 0;
};

}  // namespace efm
