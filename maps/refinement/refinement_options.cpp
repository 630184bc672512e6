// SPDX-License-Identifier: BSD-3-Clause
#include "maps/refinement/refinement_options.h"

#include "mapping/base/named_choice.h"

namespace efm {

void RefinementOptions::validate() const {
  tracker.validate();
  points.validate();
  registration.validate();
  loop.validate();
  graph.validate();
  requireOption(window >= 1 && window <= 1000, "window", window, "from 1 to 1000 (keyframes)");
  requireOption(map_keyframes >= 1 && map_keyframes <= 100, "map_keyframes", map_keyframes,
                "from 1 to 100");
}

}  // namespace efm
