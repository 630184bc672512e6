// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/sample.h"

#include <algorithm>
#include <cmath>

#include "mapping/geometry/timestamp.h"

namespace efm {

std::int64_t trajectoryTime(std::int64_t t_ns, std::int64_t time_offset_ns) {
  const auto within = [](std::int64_t t) { return std::clamp(t, -kEndOfTimeNs, kEndOfTimeNs); };
  return within(within(t_ns) + within(time_offset_ns));
}

std::int64_t nearestTick(std::int64_t t_ns) {
  std::int64_t ticks = t_ns / kTickNs;
  const std::int64_t rest_ns = t_ns % kTickNs;
  if (2 * rest_ns >= kTickNs) ++ticks;
  if (2 * rest_ns < -kTickNs) --ticks;
  return ticks * kTickNs;
}

Rigid3 roundedPose(const Rigid3& T_a_b) {
  // The operations have MRPT's order, so that the last bit is equal.
  const Eigen::Quaterniond unit = T_a_b.rotation.normalized();
  const double sign = unit.w() < 0 ? -1 : 1;
  double r = sign * unit.w(), x = sign * unit.x(), y = sign * unit.y(), z = sign * unit.z();
  const double scale = 1.0 / std::sqrt(r * r + x * x + y * y + z * z);
  r *= scale;
  x *= scale;
  y *= scale;
  z *= scale;
  Eigen::Matrix3d R_a_b;
  R_a_b << r * r + x * x - y * y - z * z, 2 * (x * y - r * z), 2 * (z * x + r * y),  //
      2 * (x * y + r * z), r * r - x * x + y * y - z * z, 2 * (y * z - r * x),       //
      2 * (z * x - r * y), 2 * (y * z + r * x), r * r - x * x - y * y + z * z;
  return {Eigen::Quaterniond(R_a_b).normalized(), T_a_b.translation};
}

}  // namespace efm
