// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/point_text.h"

#include <sstream>

namespace efm {

std::string pointText(const CloudPoint& point) {
  std::ostringstream text;
  text.precision(17);
  text << "point (" << point.p_world.x() << ", " << point.p_world.y() << ", " << point.p_world.z()
       << ")";
  return text.str();
}

}  // namespace efm
