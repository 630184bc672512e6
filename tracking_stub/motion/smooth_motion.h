// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tracking_stub/motion/motion.h"

namespace efm {

/// amplitude * sin(2 pi frequency t + phase).
struct Sine {
  double amplitude = 0;  ///< Metres or radians.
  double frequency_hz = 0;
  double phase_rad = 0;
};

struct SmoothMotionOptions {
  std::int64_t start_ns = 0;                           ///< t = 0 of the sines.
  Rigid3 T_world_center;                               ///< The rig moves around this pose.
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< Along the axes of `center`, m/s.
  std::array<std::vector<Sine>, 3> translation;        ///< Along the axes of `center`, metres.
  std::array<std::vector<Sine>, 3> rotation;           ///< A rotation vector in `center`, radians.
};

/// Hand-held motion: a constant velocity and, in each of the six degrees of freedom, a sum of
/// sines.
class SmoothMotion : public Motion {
 public:
  explicit SmoothMotion(const SmoothMotionOptions& options) : options_(options) {}
  Rigid3 poseAt(std::int64_t t_ns) const override;

 private:
  SmoothMotionOptions options_;
};

}  // namespace efm
