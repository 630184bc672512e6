// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/core/Clock.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CObservation.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/poses/CPose3D.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>

#include "mapping/geometry/rigid3.h"
#include "maps/refinement/pose_refinement.h"
#include "plugin/recordings/streams/sample.h"

namespace efm {

/// Returns the nearest tick, at most 50 ns away.
inline mrpt::Clock::time_point mrptTimeFrom(std::int64_t t_ns) {
  return mrpt::Clock::time_point(
      mrpt::Clock::duration(nearestTick(t_ns) / kTickNs + kMrptTicksAtUnixEpoch));
}

/// Converts a time exactly. @return std::nullopt for INVALID_TIMESTAMP (0 ticks) and for a time
/// outside the range of nanoseconds: before 1677 or after 2262.
inline std::optional<std::int64_t> nanosecondsIfKnown(const mrpt::Clock::time_point& time) {
  constexpr std::int64_t kMaxTicks = std::numeric_limits<std::int64_t>::max() / kTickNs;
  const std::int64_t ticks = time.time_since_epoch().count();
  if (ticks < kMrptTicksAtUnixEpoch - kMaxTicks || ticks > kMrptTicksAtUnixEpoch + kMaxTicks) {
    return std::nullopt;
  }
  return (ticks - kMrptTicksAtUnixEpoch) * kTickNs;
}

/// Converts exactly. @throws std::invalid_argument if `nanosecondsIfKnown` returns std::nullopt.
inline std::int64_t nanosecondsFrom(const mrpt::Clock::time_point& time) {
  const std::optional<std::int64_t> t_ns = nanosecondsIfKnown(time);
  if (!t_ns) throw std::invalid_argument("a time stamp is missing or not between 1678 and 2261");
  return *t_ns;
}

/// The next two functions convert from and to MRPT's poses, exactly to about 1e-15 at any rotation:
/// through MRPT's rotation matrix and quaternion, not through MRPT's angles.
Rigid3 rigidFrom(const mrpt::poses::CPose3D& pose);
mrpt::poses::CPose3D mrptPoseFrom(const Rigid3& T_a_b);

/// Returns a pose with covariance. MRPT's covariance is of x, y, z, yaw, pitch and roll.
/// @param covariance covariance of a small motion of the pose: a translation along the axes of
/// frame a, then a rotation vector about these axes. `poseCovariance` returns such a matrix.
mrpt::poses::CPose3DPDFGaussian mrptPoseFrom(const Rigid3& T_a_b, const Matrix6d& covariance);

/// Returns the source of a pose: a CObservationRobotPose (the label "actions" means "composed from
/// actions") or a CObservationOdometry. @return std::nullopt for other observations.
std::optional<PoseSourceId> poseSourceOf(const mrpt::obs::CObservation& observation);

/// Returns the pose of an observation: T_world_body is the observation's pose, T_body_rig the
/// inverse of its sensor's pose on the robot. Odometry is a pose in the plane z = 0.
/// @return std::nullopt for other observations. @throws std::invalid_argument if it has no time.
std::optional<PoseSample> poseIn(const mrpt::obs::CObservation& observation);

/// Makes a CObservationRobotPose with the label of the source. MRPT rounds the time: see
/// `nearestTick`.
mrpt::obs::CObservation::Ptr poseObservation(const PoseSample& pose);

/// The label of poses that are composed from actions; see `poseSourceOf`.
inline constexpr const char* kActionsLabel = "actions";

/// Composes the movements of actions to a pose, starting at the identity.
class DeadReckoning {
 public:
  /// Adds the mean pose change of the first CActionRobotMovement2D or 3D. Other actions have no
  /// effect.
  /// @param frame observations after the movement. Its time is used if the movement has no time.
  /// @return the pose after the movement, a CObservationRobotPose labelled "actions"; null if there
  /// is no movement.
  mrpt::obs::CObservation::Ptr poseAfter(const mrpt::obs::CActionCollection& action,
                                         const mrpt::obs::CSensoryFrame& frame);

 private:
  Rigid3 T_world_body_;
};

/// The newest pose of the rig from each source, with the covariance that the tracker states.
class TrackerPoses {
 public:
  /// Adds a pose. @param observation the observation that contains `pose`.
  void add(const mrpt::obs::CObservation& observation, const PoseSample& pose);
  /// @param selected the source that is used. Before a source is selected, the first source with
  /// poses in the world is used.
  /// @return the newest pose; null before the source's first pose.
  const mrpt::poses::CPose3DPDFGaussian* newest(const std::optional<PoseSourceId>& selected) const;

 private:
  struct Newest {
    std::int64_t t_ns = 0;
    mrpt::poses::CPose3DPDFGaussian pose;
  };
  std::map<PoseSourceId, Newest> newest_;
};

}  // namespace efm
