// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/events/window.h"

#include <stdexcept>

#include "mapping/geometry/timestamp.h"

namespace efm {

void TimeLimits::validate() const {
  if (!t0_ns || !t1_ns || *t0_ns < *t1_ns) return;
  throw std::invalid_argument("t1 = " + formatSeconds(*t1_ns) +
                              " s: must be after t0 = " + formatSeconds(*t0_ns) + " s");
}

}  // namespace efm
