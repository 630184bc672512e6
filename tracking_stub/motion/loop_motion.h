// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>

#include "tracking_stub/motion/motion.h"

namespace efm {

struct LoopMotionOptions {
  std::int64_t start_ns = 0;  ///< The rig is on the +x axis of the ellipse then.
  double period_s = 8;        ///< Of one loop, above 0.
  double radius_x_m = 1;      ///< Half axes of the ellipse.
  double radius_y_m = 1;
  double height_m = 1.2;  ///< Above the origin.
  /// Viewing direction, counter-clockwise from above: 0 is outwards, pi/2 is forwards.
  double heading_rad = 0;
  /// Added motion, in the frame of the camera on the loop. Optional.
  std::shared_ptr<const Motion> sway;
};

/// Goes around the world's z axis on an ellipse, counter-clockwise and at a constant rate. Each
/// loop ends at its first pose. The camera (x right, y down, z forward) is level without the sway.
class LoopMotion : public Motion {
 public:
  explicit LoopMotion(const LoopMotionOptions& options);
  Rigid3 poseAt(std::int64_t t_ns) const override;

 private:
  LoopMotionOptions options_;
};

}  // namespace efm
