// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>

#include "tracking_stub/motion/motion.h"

namespace efm {

struct LoopMotionOptions {
  std::int64_t start_ns = 0;  ///< Where the loop begins: on its +x axis.
  double period_s = 8;        ///< Of one round, above 0.
  double radius_x_m = 1;      ///< Half axes of the ellipse.
  double radius_y_m = 1;
  double height_m = 1.2;  ///< Above the origin.
  /// Where the camera looks, seen from above and turning left: 0 outwards, pi/2 ahead.
  double heading_rad = 0;
  /// On top, in the frame of the camera as the loop carries it; none where not given.
  std::shared_ptr<const Motion> sway;
};

/// Around the world's z axis, counter-clockwise, on an ellipse at a constant rate: comes back to
/// where it began after every period. The camera (x right, y down, z forward) is level but for the
/// sway.
class LoopMotion : public Motion {
 public:
  explicit LoopMotion(const LoopMotionOptions& options);
  Rigid3 poseAt(std::int64_t t_ns) const override;

 private:
  LoopMotionOptions options_;
};

}  // namespace efm
