// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/live_guard.h"

#include <algorithm>
#include <utility>

#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

/// Longest time that poses wait for events.
constexpr std::int64_t kMaxEventWaitNs = 600 * kNanosecondsPerSecond;

}  // namespace

std::optional<std::int64_t> LiveGuard::admit(FusionMapper& mapper, EventPacket& packet) const {
  if (!options_.enabled) return std::nullopt;
  const auto camera = static_cast<std::size_t>(packet.camera);
  std::vector<Event> events = std::move(packet.events).take();
  const bool older = mapper.isOlder(packet.camera, events);
  if (!older) mapper.dropLate(packet.camera, events);
  packet.events = CheckedEvents(std::move(events));
  if (!older) return std::nullopt;
  return trajectoryTime(packet.events.front().t_ns, mapper.rig().cameras.at(camera).time_offset_ns);
}

void LiveGuard::noteOlder(int sensor, std::int64_t t_ns) {
  if (!options_.enabled) return;
  for (auto& [other, older] : older_) older.others_ns.erase(sensor);
  const Older& older = older_.try_emplace(sensor, Older{t_ns, {}}).first->second;
  const bool alone = sensor != kTracker &&
                     std::any_of(older.others_ns.begin(), older.others_ns.end(), [&](auto& other) {
                       return other.second - t_ns > kNanosecondsPerSecond;
                     });
  if (alone || t_ns - older.since_ns < kNanosecondsPerSecond) return;
  clock_went_back_ = true;
}

void LiveGuard::noteOlderPose(std::int64_t t_ns) {
  if (newest_pose_ && t_ns < newest_pose_->t_ns - kNanosecondsPerSecond) noteOlder(kTracker, t_ns);
}

void LiveGuard::noteInTime(int sensor, std::int64_t t_ns) {
  older_.erase(sensor);
  if (sensor == kTracker) return;
  for (auto& [other, older] : older_) older.others_ns[sensor] = t_ns;
}

void LiveGuard::hold(std::function<void()> input, std::size_t events) {
  held_.push_back(std::move(input));
  held_events_ += events;
}

std::vector<std::function<void()>> LiveGuard::beginClock() {
  ++status_.clock_resets;
  clock_went_back_ = false;
  held_events_ = 0;
  older_.clear();
  newest_pose_.reset();
  after_jump_.clear();
  missing_.clear();
  return std::exchange(held_, {});
}

bool LiveGuard::holdsPose(const NoisyPose& pose) {
  if (!options_.enabled || (!jumped() && !isJump(pose))) return false;
  after_jump_.push_back(pose);
  return true;
}

bool LiveGuard::isJump(const NoisyPose& next) const {
  if (!newest_pose_ || next.pose.t_ns <= newest_pose_->t_ns) return false;
  constexpr double kSigmas = 5;
  const PoseNoise noise = next.noise.value_or(PoseNoise{});
  const double dt_s = secondsBetween(newest_pose_->t_ns, next.pose.t_ns);
  const Rigid3 motion = newest_pose_->T_world_rig.inverse() * next.pose.T_world_rig;
  const double turn_rad = Eigen::AngleAxisd(motion.rotation).angle();
  return motion.translation.norm() > options_.max_speed_m_s * dt_s + kSigmas * noise.noise_m ||
         std::min(turn_rad, 2 * kPi - turn_rad) >
             options_.max_turn_deg_s * kRadiansPerDegree * dt_s + kSigmas * noise.noise_rad;
}

void LiveGuard::notePose(const StampedPose& pose) {
  if (!newest_pose_ || pose.t_ns >= newest_pose_->t_ns) newest_pose_ = pose;
}

std::vector<NoisyPose> LiveGuard::beginSegment() {
  ++status_.pose_jumps;
  newest_pose_.reset();
  return std::exchange(after_jump_, {});
}

void LiveGuard::noteMissing(int camera, const MissingEvents& missing) {
  MissingEvents& noted = missing_[camera];
  noted = {std::max(noted.until_ns, missing.until_ns), missing.reason};
}

/// @return std::nullopt if nothing is missing, or the camera is not in the rig yet.
std::optional<std::int64_t> LiveGuard::missingUntil(const FusionMapper& mapper, int camera) const {
  const auto missing = missing_.find(camera);
  const auto index = static_cast<std::size_t>(camera);
  const std::vector<RigCamera>& cameras = mapper.rig().cameras;
  if (missing == missing_.end() || index >= cameras.size()) return std::nullopt;
  return trajectoryTime(missing->second.until_ns, cameras[index].time_offset_ns);
}

void LiveGuard::dropMissing(FusionMapper& mapper, int camera, std::int64_t next_ns) {
  const std::optional<std::int64_t> until_ns = missingUntil(mapper, camera);
  if (!until_ns) return;
  mapper.dropWindowsBefore(std::min(*until_ns, next_ns), missing_.at(camera).reason);
  missing_.erase(camera);
}

void LiveGuard::dropOverdue(FusionMapper& mapper, std::int64_t newest_begin_ns) {
  const std::map<int, MissingEvents> missing = missing_;
  for (const auto& [camera, events] : missing) {
    const std::optional<std::int64_t> until_ns = missingUntil(mapper, camera);
    if (until_ns && *until_ns <= newest_begin_ns) dropMissing(mapper, camera, kMaxTimeNs);
  }
}

void LiveGuard::dropAllMissing(FusionMapper& mapper) {
  dropOverdue(mapper, kMaxTimeNs);
  missing_.clear();
}

bool LiveGuard::fillsQueue(std::uint64_t events) const {
  return options_.enabled && static_cast<double>(events) > options_.queueEvents() / 2;
}

std::optional<std::int64_t> LiveGuard::limitWaits(FusionMapper& mapper,
                                                  PoseSourceSelector& pose_source,
                                                  const std::optional<TimeSpan>& events) {
  if (!options_.enabled) return std::nullopt;
  pose_source.limitWaiting(kMaxEventWaitNs);
  std::optional<std::int64_t> newest_ns = pose_source.waitingNs();
  if (newest_pose_) {
    newest_ns = jumped() ? after_jump_.back().pose.t_ns : newest_pose_->t_ns;
    mapper.setAllCompleteUntil(*newest_ns - kMaxEventWaitNs);
  }
  std::optional<std::int64_t> needed_ns;
  if (newest_ns) {
    needed_ns = std::max(*newest_ns, -kEndOfTimeNs) - kMaxEventWaitNs;
    const auto in_time =
        std::find_if(after_jump_.begin(), after_jump_.end(),
                     [&](const NoisyPose& waiting) { return waiting.pose.t_ns >= *needed_ns; });
    after_jump_.erase(after_jump_.begin(), in_time);
  }
  if (!events) return needed_ns;
  const std::int64_t overdue_ns = events->last_ns - durationFromSeconds(options_.max_pose_wait_s);
  if (!newest_ns || *newest_ns < overdue_ns) {
    mapper.dropWindowsBefore(overdue_ns, DropReason::kNoPose);
  }
  return needed_ns;
}

bool LiveGuard::countRejectedPose() {
  status_.rejected_poses += options_.enabled ? 1 : 0;
  return options_.enabled;
}

std::optional<LiveStatus> LiveGuard::status(const std::map<int, std::uint64_t>& rejected,
                                            const MapperCounts& counts,
                                            const std::vector<int>& selected) const {
  if (!options_.enabled) return std::nullopt;
  LiveStatus status = status_;
  for (const auto& [camera, events] : rejected) status.cameras[camera].lost += events;
  for (std::size_t c = 0; c < counts.cameras.size(); ++c) {
    const auto camera = static_cast<int>(c);
    if (!isSelected(camera, selected)) continue;
    status.cameras[camera].lost += counts.cameras[c].fates.losses();
  }
  return status;
}

}  // namespace efm
