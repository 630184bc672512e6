// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/trajectory.h"

namespace efm {

/// A motion that is known at every time.
class Motion {
 public:
  virtual ~Motion() = default;
  /// Returns T_world_rig. Thread-safe.
  virtual Rigid3 poseAt(std::int64_t t_ns) const = 0;
};

struct LoopMotionOptions {
  std::int64_t start_ns = 0;  ///< Time at which the rig is on the +x axis of the ellipse.
  double period_s = 8;        ///< Duration of one loop, above 0.
  double radius_x_m = 1;      ///< Half axes of the ellipse, in x and y.
  double radius_y_m = 1;
  double height_m = 1.2;  ///< Height above the origin.
  /// Viewing direction, counter-clockwise from above: 0 is outwards, pi/2 is forwards.
  double heading_rad = 0;
  /// Additional motion, in the frame of the camera on the loop. May be null.
  std::shared_ptr<const Motion> sway;
};

/// A motion around the world's z axis on an ellipse, counter-clockwise and at a constant rate. Each
/// loop ends at its first pose. The camera (x right, y down, z forward) is level without the sway.
class LoopMotion : public Motion {
 public:
  explicit LoopMotion(const LoopMotionOptions& options);
  Rigid3 poseAt(std::int64_t t_ns) const override;

 private:
  LoopMotionOptions options_;
};

/// The function amplitude * sin(2 pi frequency t + phase).
struct Sine {
  double amplitude = 0;  ///< Metres or radians.
  double frequency_hz = 0;
  double phase_rad = 0;
};

struct SmoothMotionOptions {
  std::int64_t start_ns = 0;                           ///< Time t = 0 of the sines.
  Rigid3 T_world_center;                               ///< The rig moves around this pose.
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< Velocity in `center`, m/s.
  std::array<std::vector<Sine>, 3> translation;  ///< Sines along the axes of `center`, metres.
  std::array<std::vector<Sine>, 3> rotation;     ///< A rotation vector in `center`, radians.
};

/// A hand-held motion: a constant velocity and a sum of sines in each of the six degrees of
/// freedom.
class SmoothMotion : public Motion {
 public:
  explicit SmoothMotion(const SmoothMotionOptions& options) : options_(options) {}
  Rigid3 poseAt(std::int64_t t_ns) const override;

 private:
  SmoothMotionOptions options_;
};

/// Smooths measured poses. A single pose that jumps is removed: its distance from the line between
/// its neighbours is over 8 times the median. The other poses are resampled every 5 ms, also across
/// gaps of up to 1 s. A windowed sinc, a low-pass at 10 Hz without delay, filters positions, and
/// rotations in the tangent space at each sample. Poses may be in any order. If two poses have the
/// same time, the first one is used.
std::vector<StampedPose> smoothTrajectory(const std::vector<StampedPose>& poses);

/// Returns the start of the first half second in which a recording moves with at least half of its
/// mean speed. Returns the time of the first pose if the recording never moves.
/// @param poses at least one pose, in the order of time.
std::int64_t startOfMotion(const std::vector<StampedPose>& poses);

/// The motion through evenly spaced poses: linear in position and slerp in rotation. It is at rest
/// before the first pose and after the last pose.
class SampledMotion : public Motion {
 public:
  explicit SampledMotion(std::vector<StampedPose> poses);
  Rigid3 poseAt(std::int64_t t_ns) const override;

 private:
  std::vector<StampedPose> poses_;
  std::int64_t period_ns_;
};

}  // namespace efm
