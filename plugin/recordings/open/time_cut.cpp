// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/time_cut.h"

#include <algorithm>
#include <utility>

#include "mapping/keyframes/fusion_mapper.h"
#include "plugin/mrpt/pose_observation.h"

namespace efm {
namespace {

using mrpt::obs::CObservation;

/// A camera's packets come at most this long after those of another camera.
constexpr std::int64_t kMaxCameraLagNs = kNanosecondsPerSecond;

/// The begin of a packet: the earliest of its times. Its own time may be missing, or be the time at
/// which the object was made: MRPT's default.
/// @return nothing where it has neither an event nor a covered time.
std::optional<std::int64_t> beginOf(const CObservationEvents& packet) {
  if (packet.events.empty() && !packet.covered_until_ns) return std::nullopt;
  std::int64_t begin_ns = packet.covered_until_ns.value_or(kMaxTimeNs);
  if (!packet.events.empty()) begin_ns = std::min(begin_ns, packet.events.front().t_ns);
  return std::min(begin_ns, nanosecondsIfKnown(packet.timestamp).value_or(kMaxTimeNs));
}

/// @return whether the packet still says something: it has an event, or covers a time.
bool cutEvents(CObservationEvents& packet, std::int64_t begin_ns, std::int64_t t0_ns,
               std::int64_t t1_ns) {
  auto& events = packet.events;
  const auto outside = [&](const Event& event) {
    return event.t_ns < t0_ns || event.t_ns >= t1_ns;
  };
  events.erase(std::remove_if(events.begin(), events.end(), outside), events.end());
  if (nanosecondsIfKnown(packet.timestamp).value_or(kMaxTimeNs) < t0_ns) {
    packet.timestamp = mrptTimeFrom(events.empty() ? t0_ns : events[0].t_ns);
  }
  if (!packet.covered_until_ns) return !events.empty();
  const bool covers = *packet.covered_until_ns > t0_ns && begin_ns < t1_ns;
  packet.covered_until_ns = std::min(*packet.covered_until_ns, t1_ns);
  return !events.empty() || covers;
}

}  // namespace

TimeCut::TimeCut(std::unique_ptr<Recording> recording, std::optional<std::int64_t> t0_ns,
                 std::optional<std::int64_t> t1_ns)
    : recording_(std::move(recording)),
      t0_ns_(t0_ns.value_or(kMinTimeNs)),
      t1_ns_(t1_ns.value_or(kMaxTimeNs)) {
  TimeLimits{t0_ns, t1_ns}.validate();
}

CObservation::Ptr TimeCut::next() {
  while (ready_.empty()) {
    if (!readOne()) return nullptr;
  }
  const auto packet = std::dynamic_pointer_cast<CObservationEvents>(ready_.front());
  if (packet && !packet->events.empty() && !announcements_.empty()) announceBefore(*packet);
  CObservation::Ptr observation = std::move(ready_.front());
  ready_.pop_front();
  return observation;
}

/// Nothing of a camera comes before t0; its first packet must begin where the announcement ends.
void TimeCut::announceBefore(const CObservationEvents& first) {
  for (auto entry = announcements_.rbegin(); entry != announcements_.rend(); ++entry) {
    const CObservationEvents::Ptr& announcement = entry->second;
    std::int64_t& covered_ns = *announcement->covered_until_ns;
    if (entry->first == first.camera_index) {
      covered_ns = first.events.front().t_ns;
    } else {
      covered_ns = std::clamp(covered_ns, t0_ns_, t1_ns_);
    }
    announcement->timestamp = mrptTimeFrom(first.events.front().t_ns);
    ready_.push_front(announcement);
  }
  announcements_.clear();
}

/// @return false once nothing can follow.
bool TimeCut::readOne() {
  const CObservation::Ptr observation =
      events_ended_ && posesEnded() ? nullptr : recording_->next();
  if (!observation) {
    const bool something_left = !began_ && !across_.empty();
    deliver(nullptr);
    return something_left;
  }
  if (const auto pose = poseIn(*observation)) {
    addPose(observation, poses_[*poseSourceOf(*observation)], pose->t_ns);
  } else if (const auto packet = std::dynamic_pointer_cast<CObservationEvents>(observation)) {
    addPacket(packet);
  } else {
    addOther(observation);
  }
  return true;
}

bool TimeCut::posesEnded() const {
  return !poses_.empty() && std::all_of(poses_.begin(), poses_.end(),
                                        [](const auto& entry) { return entry.second.ended; });
}

void TimeCut::addPose(const CObservation::Ptr& pose, PoseTrack& track, std::int64_t t_ns) {
  if (t_ns < t0_ns_ && !began_) {
    track.before = pose;
  } else if (t_ns < t1_ns_ || !std::exchange(track.ended, true)) {
    // A late tracker's pose from before t0 may come after t0's observations. The first pose from t1
    // on is the last one needed.
    deliver(pose);
  }
}

/// Events end when every camera has passed t1 and all have had time to appear; at the latest when
/// one camera is far beyond t1: then the others are silent.
void TimeCut::noteProgress(int camera, std::int64_t begin_ns, std::int64_t covered_until_ns) {
  bool& passed = passed_t1_[camera];
  passed = passed || begin_ns >= t1_ns_ || covered_until_ns >= t1_ns_;
  first_begin_ns_ = std::min(first_begin_ns_, begin_ns);
  const bool all_passed = std::all_of(passed_t1_.begin(), passed_t1_.end(),
                                      [](const auto& entry) { return entry.second; });
  const bool all_there = begin_ns - kMaxCameraLagNs >= first_begin_ns_;
  const bool far_beyond = begin_ns - kMaxCameraLagNs >= t1_ns_;
  if ((all_passed && all_there) || far_beyond) events_ended_ = true;
}

void TimeCut::addPacket(const CObservationEvents::Ptr& packet) {
  const std::optional<std::int64_t> begin_ns = beginOf(*packet);
  if (!begin_ns) return;
  if (packet->events.empty() && !has_events_) {
    announcements_[packet->camera_index] = packet;
    return;
  }
  has_events_ = true;
  noteProgress(packet->camera_index, *begin_ns, packet->covered_until_ns.value_or(*begin_ns));
  if (!cutEvents(*packet, *begin_ns, t0_ns_, t1_ns_)) return;
  if (*begin_ns < t0_ns_ && !began_) {
    across_.push_back(packet);
  } else {
    deliver(packet);
  }
}

void TimeCut::addOther(const CObservation::Ptr& observation) {
  const std::optional<std::int64_t> t_ns = nanosecondsIfKnown(observation->timestamp);
  if (!t_ns || (*t_ns >= t0_ns_ && *t_ns < t1_ns_)) deliver(observation);
}

/// Before the first observation from t0 on come the packets across t0, and before these the poses.
void TimeCut::deliver(const CObservation::Ptr& observation) {
  if (!std::exchange(began_, true)) {
    std::vector<CObservation::Ptr> before;
    for (auto& [source, track] : poses_) {
      if (track.before) before.push_back(std::exchange(track.before, nullptr));
    }
    std::stable_sort(before.begin(), before.end(),
                     [](const auto& a, const auto& b) { return a->timestamp < b->timestamp; });
    ready_.insert(ready_.end(), before.begin(), before.end());
    ready_.insert(ready_.end(), across_.begin(), across_.end());
    across_.clear();
  }
  if (observation) ready_.push_back(observation);
}

std::unique_ptr<Recording> cutTime(std::unique_ptr<Recording> recording,
                                   std::optional<std::int64_t> t0_ns,
                                   std::optional<std::int64_t> t1_ns) {
  if (!t0_ns && !t1_ns) return recording;
  return std::make_unique<TimeCut>(std::move(recording), t0_ns, t1_ns);
}

}  // namespace efm
