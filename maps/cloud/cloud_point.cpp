// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/cloud_point.h"

#include <sstream>

namespace efm {
namespace {

constexpr int kAllDigits = 17;

}  // namespace

std::string positionText(const CloudPoint& point) {
  std::ostringstream text;
  text.precision(kAllDigits);
  text << "(" << point.p_world.x() << ", " << point.p_world.y() << ", " << point.p_world.z() << ")";
  return text.str();
}

std::string pointText(const CloudPoint& point) {
  std::ostringstream text;
  text.precision(kAllDigits);
  text << positionText(point) << " with confidence " << point.confidence;
  return text.str();
}

}  // namespace efm
