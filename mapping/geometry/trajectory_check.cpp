// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/trajectory_check.h"

#include <algorithm>

#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

double metresBetween(const StampedPose& a, const StampedPose& b) {
  return (a.T_world_rig.translation - b.T_world_rig.translation).norm();
}
double angleBetween(const StampedPose& a, const StampedPose& b) {
  return a.T_world_rig.rotation.angularDistance(b.T_world_rig.rotation);
}
double distanceBetween(const StampedPose& a, const StampedPose& b) {
  return distanceBetween(a.T_world_rig, b.T_world_rig);
}

/// Counts a conflict; keeps the numbers of its first two poses.
void count(const StampedPose& a, std::size_t first, const StampedPose& b, std::size_t second,
           TrajectoryConflict& conflict) {
  if (conflict.count++ > 0) return;
  conflict.first = first;
  conflict.second = second;
  conflict.distance_m = metresBetween(a, b);
  conflict.angle_rad = angleBetween(a, b);
}

/// Returns the acceleration that three poses need; 1 is what no rig has: 600 m/s² or 2000 rad/s².
double violenceOf(const StampedPose& a, const StampedPose& b, const StampedPose& c) {
  const auto motion = [](const StampedPose& from, const StampedPose& to) {
    return differenceOf(from.T_world_rig.inverse() * to.T_world_rig);
  };
  const double before_s = secondsBetween(a.t_ns, b.t_ns);
  const double after_s = secondsBetween(b.t_ns, c.t_ns);
  const Vector6d change = motion(b, c) * before_s - motion(a, b) * after_s;
  const double per_unit = std::max(before_s * after_s * (before_s + after_s) / 2, 1e-18);
  return std::max(change.head<3>().norm() / 600, change.tail<3>().norm() / 2000) / per_unit;
}

}  // namespace

void TrajectoryCheck::add(const StampedPose& pose) {
  constexpr std::size_t kLastPoses = 128;
  compareWithSameTime(pose);
  if (takes_lost_ || !isLost(pose)) {
    if (!last_.empty()) lookForChange(pose);
    last_.push_back(pose);
    last_number_ = changes_.of;
    if (last_.size() > kLastPoses) last_.pop_front();
  }
  ++changes_.of;
}

/// Returns whether a pose is the identity, or repeats a pose that is not the one before it.
bool TrajectoryCheck::isLost(const StampedPose& pose) {
  for (std::size_t i = 0; i + 1 < last_.size(); ++i) {
    if (isSame(last_[i].T_world_rig, pose.T_world_rig) &&
        !isSame(last_[i].T_world_rig, last_.back().T_world_rig)) {
      lost_ = pose.T_world_rig;
    }
  }
  return isSame(pose.T_world_rig, Rigid3()) || isSame(pose.T_world_rig, lost_);
}

void TrajectoryCheck::compareWithSameTime(const StampedPose& pose) {
  constexpr double kSameM = 1e-3;
  constexpr double kSameRad = 0.1 * kRadiansPerDegree;
  if (equal_times_.of == 0 || pose.t_ns != of_time_.t_ns) {
    of_time_ = pose;
    of_time_number_ = changes_.of;
    differs_ = false;
    ++equal_times_.of;
  } else if (!differs_ &&
             (metresBetween(of_time_, pose) > kSameM || angleBetween(of_time_, pose) > kSameRad)) {
    differs_ = true;
    count(of_time_, of_time_number_, pose, changes_.of, equal_times_);
  }
}

/// Looks whether the newest pose leaves the place of the pose before it for an earlier place.
void TrajectoryCheck::lookForChange(const StampedPose& pose) {
  constexpr double kMinDistance = 0.02;
  constexpr std::int64_t kSamePlaceNs = 500'000'000;  // between two poses of one place
  constexpr std::size_t kMaxBodies = 8;               // with one pose each between two poses
  const StampedPose& before = last_.back();
  const double distance = distanceBetween(before, pose);
  if (distance < kMinDistance || last_.size() < 2) return;
  const double violence = violenceOf(last_[last_.size() - 2], before, pose);
  if (violence < 0.5) return;                  // half: before the leap, the motion was usual
  if (4 * distance >= last_change_) ++leaps_;  // a shorter one is a usual motion
  if (violence < 1) return;
  for (std::size_t i = last_.size() - 1; i-- > 0;) {
    const StampedPose& earlier = last_[i];
    if (pose.t_ns - earlier.t_ns > kSamePlaceNs) return;
    if (distanceBetween(earlier, pose) < distance / 4) {
      last_change_ = distance;
      return count(before, last_number_, pose, changes_.of, changes_);
    }
    // Farther back than the places of several bodies, there are only poses of the place before.
    if (i + kMaxBodies < last_.size() && distanceBetween(earlier, before) > distance / 2) return;
  }
}

std::optional<TrajectoryConflict> TrajectoryCheck::conflict() const {
  constexpr std::uint64_t kMinChanges = 8;
  if (100 * equal_times_.count > equal_times_.of) return equal_times_;
  if (changes_.count >= kMinChanges && 20 * changes_.count > changes_.of &&
      3 * changes_.count > 2 * leaps_) {
    return changes_;
  }
  return std::nullopt;
}

}  // namespace efm
