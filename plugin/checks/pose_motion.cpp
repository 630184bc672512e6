// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/checks/pose_motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

/// Time of the poses that give the speed at a step: shorter than most accelerations, longer than
/// the jitter of a tracker.
constexpr std::int64_t kReachNs = 50'000'000;
/// Time of the poses that give the speed before and after repeated poses.
constexpr std::int64_t kHoldReachNs = 200'000'000;
/// Number of poses after a step before it is evaluated, beside the time `kHoldReachNs`.
constexpr std::size_t kStepsAround = 2;
/// LiDAR odometry has a pose per turn, 0.1 s with a little jitter: a normal gap.
constexpr std::int64_t kMinGapNs = 105'000'000;
constexpr std::size_t kMaxBins = 1024;

using Poses = std::deque<StampedPose>;

struct Velocity {
  Eigen::Vector3d linear;   // m/s
  Eigen::Vector3d angular;  // rad/s
};

Velocity velocityOf(const StampedPose& from, const StampedPose& to) {
  const double dt_s = secondsBetween(from.t_ns, to.t_ns);
  Eigen::Quaterniond turn = from.T_world_rig.rotation.conjugate() * to.T_world_rig.rotation;
  if (turn.w() < 0) turn.coeffs() = -turn.coeffs();  // the shorter rotation
  const double sine = turn.vec().norm();
  const double angle = 2 * std::atan2(sine, turn.w());
  const Eigen::Vector3d rotation =
      sine > 0 ? Eigen::Vector3d(turn.vec() * (angle / sine)) : Eigen::Vector3d::Zero();
  return {(to.T_world_rig.translation - from.T_world_rig.translation) / dt_s, rotation / dt_s};
}

MotionAmount differenceOf(const Velocity& a, const Velocity& b) {
  return {(a.linear - b.linear).norm(), (a.angular - b.angular).norm()};
}

Velocity meanOf(const Velocity& a, const Velocity& b) {
  return {(a.linear + b.linear) / 2, (a.angular + b.angular) / 2};
}

/// Compares times, for a binary search: trackers may have 100,000 poses a second.
struct IsBefore {
  bool operator()(std::int64_t t_ns, const StampedPose& pose) const { return t_ns < pose.t_ns; }
  bool operator()(const StampedPose& pose, std::int64_t t_ns) const { return pose.t_ns < t_ns; }
};
constexpr IsBefore isBefore;

/// Returns the velocity before a pose, over a number of steps and, if there are more poses, a time.
std::optional<Velocity> velocityBefore(const Poses& poses, std::size_t last, std::int64_t reach_ns,
                                       std::size_t steps) {
  if (last < steps) return std::nullopt;
  const auto end = poses.begin() + static_cast<std::ptrdiff_t>(last - steps + 1);
  const auto after = std::upper_bound(poses.begin(), end, poses[last].t_ns - reach_ns, isBefore);
  return velocityOf(after == poses.begin() ? *after : *(after - 1), poses[last]);
}

/// Returns the velocity after a pose.
std::optional<Velocity> velocityAfter(const Poses& poses, std::size_t first, std::int64_t reach_ns,
                                      std::size_t steps) {
  if (first + steps >= poses.size()) return std::nullopt;
  const auto begin = poses.begin() + static_cast<std::ptrdiff_t>(first + steps);
  const auto last = std::lower_bound(begin, poses.end(), poses[first].t_ns + reach_ns, isBefore);
  return velocityOf(poses[first], last == poses.end() ? poses.back() : *last);
}

MotionAmount speedOf(const Velocity& velocity) {
  return {velocity.linear.norm(), velocity.angular.norm()};
}

template <typename Span, typename Value>
void keepLarger(Span& kept, const Span& other, Value value) {
  if (value(other) > value(kept)) kept = other;
}

double deviationOf(const PoseStep& step) { return step.deviation; }
double missedIn(const PoseGap& gap) { return gap.missed.sum(); }
double durationOf(const PoseHold& hold) { return secondsBetween(hold.t0_ns, hold.t1_ns); }

void merge(PoseMotion::Bin& bin, const PoseMotion::Bin& other) {
  keepLarger(bin.step_m, other.step_m, deviationOf);
  keepLarger(bin.step_rad, other.step_rad, deviationOf);
  keepLarger(bin.gap, other.gap, missedIn);
  keepLarger(bin.hold, other.hold, durationOf);
}

}  // namespace

bool isRest(const PoseHold& hold) { return hold.t1_ns - hold.t0_ns >= kHoldReachNs; }

void PoseMotion::add(const StampedPose& pose) {
  if (poses_.empty()) start_ns_ = pose.t_ns;
  poses_.push_back(pose);
  while (next_ + 1 + kStepsAround < poses_.size() &&
         pose.t_ns - poses_[next_ + 1].t_ns >= kHoldReachNs) {
    look(next_++);
  }
  while (next_ > kStepsAround && poses_[next_].t_ns - poses_[1].t_ns >= kHoldReachNs) {
    poses_.pop_front();
    --next_;
  }
}

PoseMotion PoseMotion::completed() const {
  PoseMotion motion = *this;
  while (motion.next_ + 1 < motion.poses_.size()) motion.look(motion.next_++);
  if (!motion.poses_.empty()) motion.lookAtHold(motion.next_);  // the end of the last hold
  return motion;
}

MotionAmount PoseMotion::meanSpeed() const {
  return moving_s_ > 0 ? path_ * (1 / moving_s_) : MotionAmount();
}

/// @param step from this pose of poses_ to the next one.
void PoseMotion::look(std::size_t step) {
  lookAtHold(step);
  const StampedPose& from = poses_[step];
  const StampedPose& to = poses_[step + 1];
  const Velocity velocity = velocityOf(from, to);
  const double dt_s = secondsBetween(from.t_ns, to.t_ns);
  path_.m += speedOf(velocity).m * dt_s;
  path_.rad += speedOf(velocity).rad * dt_s;
  moving_s_ += dt_s;
  if (to.t_ns - from.t_ns >= kMinGapNs) return lookAtGap(step);
  const auto before = velocityBefore(poses_, step, kReachNs, kStepsAround);
  const auto after = velocityAfter(poses_, step + 1, kReachNs, kStepsAround);
  if (!before || !after) return;
  // The smallest of three deviations. A jump deviates from all three velocities; its neighbours
  // only if the jump is within their `before` or `after`.
  MotionAmount deviation = differenceOf(velocity, meanOf(*before, *after));
  for (const Velocity& beside : {*before, *after}) {
    const MotionAmount other = differenceOf(velocity, beside);
    deviation = {std::min(deviation.m, other.m), std::min(deviation.rad, other.rad)};
  }
  Bin found;
  found.step_m = {{from.t_ns, to.t_ns}, deviation.m};
  found.step_rad = {{from.t_ns, to.t_ns}, deviation.rad};
  merge(binAt(from.t_ns), found);
}

void PoseMotion::lookAtGap(std::size_t step) {
  const StampedPose& from = poses_[step];
  const StampedPose& to = poses_[step + 1];
  const double dt_s = secondsBetween(from.t_ns, to.t_ns);
  const Velocity velocity = velocityOf(from, to);
  const auto before = velocityBefore(poses_, step, kReachNs, 1);
  const auto after = velocityAfter(poses_, step + 1, kReachNs, 1);
  PoseGap gap = {{from.t_ns, to.t_ns}, speedOf(velocity) * dt_s, {}};
  if (before && after) {
    gap.missed = differenceOf(*before, *after) * (dt_s / 8);
    const MotionAmount jump = differenceOf(velocity, meanOf(*before, *after)) * (dt_s / 2);
    gap.missed = {std::max(gap.missed.m, jump.m), std::max(gap.missed.rad, jump.rad)};
  } else if (before || after) {
    gap.missed = differenceOf(velocity, before ? *before : *after) * (dt_s / 4);
  }
  Bin found;
  found.gap = gap;
  merge(binAt(from.t_ns), found);
}

/// Begins, continues or ends a hold at the step.
void PoseMotion::lookAtHold(std::size_t step) {
  const StampedPose& from = poses_[step];
  const bool repeats =
      step + 1 < poses_.size() && isSame(from.T_world_rig, poses_[step + 1].T_world_rig);
  if (repeats == hold_.has_value()) return;
  if (repeats) {
    hold_ = PoseHold{{from.t_ns, from.t_ns}, {}, false};
    if (const auto before = velocityBefore(poses_, step, kHoldReachNs, 1)) {
      hold_->speed = speedOf(*before);
    }
    return;
  }
  Bin found;
  found.hold = *hold_;
  hold_.reset();
  found.hold.t1_ns = from.t_ns;
  if (isRest(found.hold)) moving_s_ -= durationOf(found.hold);
  // The step that ends the hold is left out: it may be a jump.
  if (const auto after = velocityAfter(poses_, step + 1, kHoldReachNs, 1)) {
    found.hold.speed_after = speedOf(*after).sum() > found.hold.speed.sum();
    if (found.hold.speed_after) found.hold.speed = speedOf(*after);
  }
  merge(binAt(found.hold.t0_ns), found);
}

PoseMotion::Bin& PoseMotion::binAt(std::int64_t t_ns) {
  auto index = static_cast<std::size_t>((t_ns - start_ns_) / bin_ns_);
  for (; index >= kMaxBins; index /= 2) {
    for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
      if (bin % 2 == 0) {
        bins_[bin / 2] = bins_[bin];
      } else {
        merge(bins_[bin / 2], bins_[bin]);
      }
    }
    bins_.resize((bins_.size() + 1) / 2);
    bin_ns_ *= 2;
  }
  if (index >= bins_.size()) bins_.resize(index + 1);
  return bins_[index];
}

}  // namespace efm
