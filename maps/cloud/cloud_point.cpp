// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/cloud_point.h"

#include "mapping/base/text.h"

namespace efm {

std::string positionText(const CloudPoint& point) {
  NumberText text;
  text << "(" << point.p_world.x() << ", " << point.p_world.y() << ", " << point.p_world.z() << ")";
  return text.str();
}

std::string pointText(const CloudPoint& point) {
  NumberText text;
  text << positionText(point) << " with confidence " << point.confidence;
  return text.str();
}

}  // namespace efm
