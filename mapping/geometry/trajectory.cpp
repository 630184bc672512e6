// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/trajectory.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>

#include "mapping/base/option.h"
#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

bool earlier(const StampedPose& pose, std::int64_t t_ns) { return pose.t_ns < t_ns; }
bool later(std::int64_t t_ns, const StampedPose& pose) { return t_ns < pose.t_ns; }

}  // namespace

Rigid3 TrajectorySegment::poseAt(std::int64_t t_ns) const {
  const std::int64_t length_ns = last.t_ns - first.t_ns;
  if (length_ns == 0) return first.T_world_rig;
  const double fraction = static_cast<double>(t_ns - first.t_ns) / static_cast<double>(length_ns);
  return interpolate(first.T_world_rig, last.T_world_rig, fraction);
}

Trajectory::Trajectory(const TrajectoryOptions& options) {
  options.validate();
  max_gap_ns_ = durationFromSeconds(options.max_pose_gap_s);
}

bool Trajectory::add(const StampedPose& pose) {
  if (pose.t_ns < -kEndOfTimeNs || pose.t_ns > kEndOfTimeNs) {
    throw std::invalid_argument("the pose at " + formatSeconds(pose.t_ns) +
                                " s: times must lie within " + formatSeconds(kEndOfTimeNs) + " s");
  }
  const Eigen::Quaterniond& rotation = pose.T_world_rig.rotation;
  if (!pose.T_world_rig.translation.allFinite() || !rotation.coeffs().allFinite() ||
      rotation.norm() < 1e-6) {
    throw std::invalid_argument("the pose at " + formatSeconds(pose.t_ns) +
                                " s: must be finite, with a quaternion that has a length");
  }
  StampedPose normalised = pose;
  normalised.T_world_rig.rotation.normalize();
  if (poses_.empty() || poses_.back().t_ns < pose.t_ns) {
    poses_.push_back(normalised);
    return true;
  }
  const auto at = std::lower_bound(poses_.begin(), poses_.end(), pose.t_ns, earlier);
  if (at->t_ns == pose.t_ns) return false;
  poses_.insert(at, normalised);
  return true;
}

void Trajectory::forgetBefore(std::int64_t t_ns) {
  // The last pose at or before t_ns is one end of the segment that contains it.
  const auto after = std::upper_bound(poses_.begin(), poses_.end(), t_ns, later);
  const auto unneeded = (after - poses_.begin()) - 1;
  // This erase moves fewer poses than it removes: constant cost on average.
  if (unneeded > static_cast<std::ptrdiff_t>(poses_.size() / 2)) {
    poses_.erase(poses_.begin(), poses_.begin() + unneeded);
  }
}

Trajectory Trajectory::moved(std::int64_t from_ns, std::int64_t to_ns,
                             const std::function<Rigid3(const StampedPose&)>& T_world_moved) const {
  // A time needs the pose before it and the pose after it.
  auto begin = std::upper_bound(poses_.begin(), poses_.end(), from_ns, later);
  if (begin != poses_.begin()) --begin;
  auto end = std::lower_bound(begin, poses_.end(), to_ns, earlier);
  if (end != poses_.end()) ++end;
  Trajectory result;
  result.max_gap_ns_ = max_gap_ns_;
  for (auto pose = begin; pose != end; ++pose) {
    result.poses_.push_back({pose->t_ns, T_world_moved(*pose)});
  }
  return result;
}

bool Trajectory::isGap(const StampedPose& before, const StampedPose& after) const {
  return after.t_ns - before.t_ns > max_gap_ns_;
}

std::optional<Rigid3> Trajectory::poseAt(std::int64_t t_ns) const {
  std::size_t cursor = 0;
  const std::optional<TrajectorySegment> segment = segmentAt(t_ns, cursor);
  if (!segment) return std::nullopt;
  return segment->poseAt(t_ns);
}

std::optional<TrajectorySegment> Trajectory::segmentAt(std::int64_t t_ns,
                                                       std::size_t& cursor) const {
  if (poses_.empty() || t_ns < poses_.front().t_ns || t_ns > poses_.back().t_ns) {
    return std::nullopt;
  }
  // The cursor is the index of the pose at or before t_ns: try it and the next index, then search.
  const auto holds = [&](std::size_t i) {
    return i < poses_.size() && poses_[i].t_ns <= t_ns &&
           (i + 1 == poses_.size() || t_ns < poses_[i + 1].t_ns);
  };
  if (!holds(cursor)) {
    if (holds(cursor + 1)) {
      ++cursor;
    } else {
      const auto after = std::upper_bound(poses_.begin(), poses_.end(), t_ns, later);
      cursor = static_cast<std::size_t>(after - poses_.begin()) - 1;
    }
  }
  const StampedPose& first = poses_[cursor];
  if (cursor + 1 < poses_.size() && !isGap(first, poses_[cursor + 1])) {
    return TrajectorySegment{first, poses_[cursor + 1]};
  }
  if (first.t_ns == t_ns) return TrajectorySegment{first, first};
  return std::nullopt;
}

Rigid3 MotionCorrection::displacement(double since_s) const {
  if (knots.empty()) return {};
  const auto last = static_cast<double>(knots.size() - 1);
  const double at = std::clamp(since_s / spacing_s + static_cast<double>(reference), 0.0, last);
  const auto before = static_cast<std::size_t>(at);
  const std::size_t after = std::min(before + 1, knots.size() - 1);
  const double along = at - static_cast<double>(before);
  return rigidFromDifference((1 - along) * knots[before] + along * knots[after]);
}

CameraMotion::CameraMotion(const TrajectorySegment& segment, const Rigid3& T_ref_world,
                           const Rigid3& T_rig_cam)
    : first_ns_(segment.first.t_ns) {
  const std::int64_t length_ns = segment.last.t_ns - first_ns_;
  if (length_ns > 0) per_ns_ = 1.0 / static_cast<double>(length_ns);
  const Rigid3 T_ref_rig0 = T_ref_world * segment.first.T_world_rig;
  const Rigid3 T_ref_rig1 = T_ref_world * segment.last.T_world_rig;
  R_ref_cam0_ = (T_ref_rig0.rotation * T_rig_cam.rotation).normalized();
  R_ref_cam1_ = (T_ref_rig1.rotation * T_rig_cam.rotation).normalized();
  rig0_ref_ = T_ref_rig0.translation;
  step_ref_ = T_ref_rig1.translation - rig0_ref_;
  lever_cam_ = T_rig_cam.rotation.conjugate() * T_rig_cam.translation;

  double cosine = R_ref_cam0_.dot(R_ref_cam1_);
  if (cosine < 0) {
    R_ref_cam1_.coeffs() = -R_ref_cam1_.coeffs();
    cosine = -cosine;
  }
  if (cosine >= 1 - std::numeric_limits<double>::epsilon()) return;
  angle_ = std::acos(cosine);
  sine_ = std::sin(angle_);
}

Rigid3 CameraMotion::poseAt(std::int64_t t_ns) const {
  const double fraction = per_ns_ * static_cast<double>(t_ns - first_ns_);
  const bool rotates = sine_ > 0;
  const double weight0 = rotates ? std::sin((1 - fraction) * angle_) / sine_ : 1 - fraction;
  const double weight1 = rotates ? std::sin(fraction * angle_) / sine_ : fraction;
  Rigid3 T_ref_cam;
  T_ref_cam.rotation.coeffs() = weight0 * R_ref_cam0_.coeffs() + weight1 * R_ref_cam1_.coeffs();
  T_ref_cam.rotation.normalize();
  T_ref_cam.translation = rig0_ref_ + fraction * step_ref_ + T_ref_cam.rotation * lever_cam_;
  return T_ref_cam;
}

void writeTumTrajectory(const std::filesystem::path& file, const std::vector<StampedPose>& poses) {
  std::ofstream stream(file);
  writeTumTrajectory(stream, poses);
  stream.close();
  if (!stream) throw std::runtime_error(file.string() + ": cannot be written");
}

void writeTumTrajectory(std::ostream& stream, const std::vector<StampedPose>& poses) {
  stream << "# t tx ty tz qx qy qz qw\n";
  for (const StampedPose& pose : poses) writeTumPose(stream, pose);
}

void writeTumPose(std::ostream& stream, const StampedPose& pose) {
  const Eigen::Vector3d& p = pose.T_world_rig.translation;
  const Eigen::Quaterniond& q = pose.T_world_rig.rotation;
  NumberText line;
  line << formatSeconds(pose.t_ns) << ' ' << p.x() << ' ' << p.y() << ' ' << p.z() << ' ' << q.x()
       << ' ' << q.y() << ' ' << q.z() << ' ' << q.w() << '\n';
  stream << line.str();
}

}  // namespace efm
