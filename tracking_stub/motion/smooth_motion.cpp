// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/motion/smooth_motion.h"

#include <cmath>

#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

constexpr double kTwoPi = 6.283185307179586476925;

double valueAt(const std::vector<Sine>& sines, double t_s) {
  double sum = 0;
  for (const Sine& sine : sines) {
    sum += sine.amplitude * std::sin(kTwoPi * sine.frequency_hz * t_s + sine.phase_rad);
  }
  return sum;
}

Eigen::Vector3d valueAt(const std::array<std::vector<Sine>, 3>& axes, double t_s) {
  return {valueAt(axes[0], t_s), valueAt(axes[1], t_s), valueAt(axes[2], t_s)};
}

}  // namespace

Rigid3 SmoothMotion::poseAt(std::int64_t t_ns) const {
  const double t_s = secondsBetween(options_.start_ns, t_ns);
  Rigid3 T_center_rig;
  T_center_rig.translation = valueAt(options_.translation, t_s) + options_.velocity * t_s;
  T_center_rig.rotation = rotationBy(valueAt(options_.rotation, t_s));
  return options_.T_world_center * T_center_rig;
}

}  // namespace efm
