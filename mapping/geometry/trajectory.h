// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "mapping/base/option.h"
#include "mapping/geometry/rigid3.h"

namespace efm {

/// The rig's pose at one time.
struct StampedPose {
  std::int64_t t_ns = 0;
  Rigid3 T_world_rig;
};

/// Noise of one pose as the tracker states it: standard deviation on each axis, metres and radians.
struct PoseNoise {
  double noise_m = 0;
  double noise_rad = 0;
};

struct TrajectoryOptions {
  /// Longest gap between neighbouring poses that is interpolated; a longer gap has no pose. Above
  /// 0. Real recordings have gaps up to 0.13 s that interpolation still bridges well.
  double max_pose_gap_s = 0.25;

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("max_pose_gap_s", self.max_pose_gap_s, Allowed::above(0, 1e6, "above 0 and at most 1e6"));
  }
  void validate() const { requireFields(*this); }
};

/// Two neighbouring poses and the closed interval between them. If a gap or the end follows a pose,
/// `first` and `last` are both that pose.
struct TrajectorySegment {
  StampedPose first;
  StampedPose last;

  /// Returns the pose at a time inside the segment.
  Rigid3 poseAt(std::int64_t t_ns) const;
};

/// The rig's motion: poses in time order, between them linear in position and slerp in rotation.
/// Never extrapolates. Not thread-safe while poses are added; queries are const.
class Trajectory {
 public:
  explicit Trajectory(const TrajectoryOptions& options = {});

  /// Adds a pose at any time; cost is constant for the newest pose. @return false, without a
  /// change, if there is a pose of the same time already.
  /// @throws std::invalid_argument if the pose is not finite, its quaternion has length 0, or its
  /// time lies beyond kEndOfTimeNs.
  bool add(const StampedPose& pose);

  /// Removes some of the poses that times from `t_ns` on do not need; cost is constant on average.
  void forgetBefore(std::int64_t t_ns);

  /// Returns T_world_rig; std::nullopt outside the recorded times or in a gap. At a recorded time
  /// it is always the recorded pose.
  std::optional<Rigid3> poseAt(std::int64_t t_ns) const;

  /// Returns the segment that contains `t_ns`. At a recorded time it is the segment that begins
  /// there, if there is one. @return std::nullopt outside the recorded times or in a gap.
  /// @param cursor any number at first; then its value after the previous call, so that nearby
  /// queries need no search.
  std::optional<TrajectorySegment> segmentAt(std::int64_t t_ns, std::size_t& cursor) const;

  /// Returns the poses that [from, to] needs, each replaced by its `T_world_moved`. Gaps stay gaps.
  Trajectory moved(std::int64_t from_ns, std::int64_t to_ns,
                   const std::function<Rigid3(const StampedPose&)>& T_world_moved) const;

  bool empty() const { return poses_.empty(); }
  const std::vector<StampedPose>& poses() const { return poses_; }

 private:
  bool isGap(const StampedPose& before, const StampedPose& after) const;

  std::int64_t max_gap_ns_;
  std::vector<StampedPose> poses_;  // strictly increasing times
};

/// The tracker's motion error within one window, in the rig's frame:
/// T_world_true(t) = T_world_rig(t) * displacement(t - t_ref). It is linear between knots at equal
/// times. The knot at the reference time stays 0, so the keyframe keeps its pose.
struct MotionCorrection {
  double spacing_s = 0;       ///< Between two knots.
  std::size_t reference = 0;  ///< Index of the knot at the reference time.
  /// Small motions: translation in metres, then a rotation vector in radians. None: no correction.
  std::vector<Vector6d> knots;
  /// The random walk that was expected of the error: standard deviations on each axis, metres and
  /// radians per root of a second. Infinite: not known.
  double walk_m = std::numeric_limits<double>::infinity();
  double walk_rad = std::numeric_limits<double>::infinity();

  /// Returns the time of a knot after (negative: before) the reference time.
  double sinceReference(std::size_t knot) const {
    return spacing_s * (static_cast<double>(knot) - static_cast<double>(reference));
  }
  /// Returns whether a time after (negative: before) the reference time lies between two knots.
  bool covers(double since_s) const {
    return !knots.empty() && since_s >= sinceReference(0) &&
           since_s <= sinceReference(knots.size() - 1);
  }
  /// Returns T_rig_true, interpolated; beyond the knots it is that of the nearest one.
  Rigid3 displacement(double since_s) const;
};

/// The motion of one camera in the reference view during one segment of the trajectory. Thousands
/// of poses are computed per segment, so terms that do not depend on time are computed once.
///
/// Slerp commutes with fixed rotations on both sides, so it runs between the camera's own
/// rotations. The camera's position is the rig's position, which moves on a line, plus the rotated
/// lever arm.
class CameraMotion {
 public:
  CameraMotion(const TrajectorySegment& segment, const Rigid3& T_ref_world,
               const Rigid3& T_rig_cam);

  /// Returns T_ref_cam = T_ref_world * segment.poseAt(t_ns) * T_rig_cam, up to rounding. `t_ns`
  /// lies inside the segment.
  Rigid3 poseAt(std::int64_t t_ns) const;

 private:
  std::int64_t first_ns_;
  double per_ns_ = 0;  // 1 / length of the segment; 0 for the segment of a single pose
  Eigen::Quaterniond R_ref_cam0_;
  Eigen::Quaterniond R_ref_cam1_;  // with the sign that is nearer to R_ref_cam0_
  double angle_ = 0;               // between the two unit quaternions: half the rotation angle
  double sine_ = 0;                // of `angle_`; 0 if too small to divide by
  Eigen::Vector3d rig0_ref_;       // position of the rig at the first pose
  Eigen::Vector3d step_ref_;       // from rig0_ref_ to the position at the last pose
  Eigen::Vector3d lever_cam_;      // from the rig to the camera
};

/// The text format of the TUM RGB-D benchmark for trajectories: a line `t tx ty tz qx qy qz qw` for
/// each pose T_world_rig, in metres and decimal seconds.

/// Writes times with nine decimals and other numbers with 17 significant digits: `readPoses` gives
/// the same poses, up to the rounding of the normalisation.
void writeTumTrajectory(const std::filesystem::path& file, const std::vector<StampedPose>& poses);
void writeTumTrajectory(std::ostream& stream, const std::vector<StampedPose>& poses);
/// Writes the line of a pose.
void writeTumPose(std::ostream& stream, const StampedPose& pose);

}  // namespace efm
