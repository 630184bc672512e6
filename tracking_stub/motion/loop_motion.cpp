// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/motion/loop_motion.h"

#include <cmath>

#include "mapping/base/named_choice.h"
#include "mapping/geometry/timestamp.h"

namespace efm {

LoopMotion::LoopMotion(const LoopMotionOptions& options) : options_(options) {
  requireOption(options_.period_s > 0, "period_s", options_.period_s, "above 0");
}

Rigid3 LoopMotion::poseAt(std::int64_t t_ns) const {
  constexpr double kTwoPi = 6.283185307179586476925;
  const double phase = kTwoPi * secondsBetween(options_.start_ns, t_ns) / options_.period_s;
  Eigen::Matrix3d R_outward_cam;  // outward: x out, y left, z up
  R_outward_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  Rigid3 T_world_cam;
  T_world_cam.translation = {options_.radius_x_m * std::cos(phase),
                             options_.radius_y_m * std::sin(phase), options_.height_m};
  T_world_cam.rotation = Eigen::AngleAxisd(phase + options_.heading_rad, Eigen::Vector3d::UnitZ()) *
                         Eigen::Quaterniond(R_outward_cam);
  return options_.sway ? T_world_cam * options_.sway->poseAt(t_ns) : T_world_cam;
}

}  // namespace efm
