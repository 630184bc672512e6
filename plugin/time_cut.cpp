// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/time_cut.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "mapping/fusion_mapper.h"
#include "plugin/CObservationEvents.h"
#include "plugin/mrpt_time.h"
#include "plugin/pose_observation.h"

namespace efm {
namespace {

using mrpt::obs::CObservation;

/// @return whether something is left: an event, or the news that there was none.
bool cutEvents(CObservationEvents& packet, std::int64_t t0_ns, std::int64_t t1_ns) {
  auto& events = packet.events;
  const auto outside = [&](const Event& event) {
    return event.t_ns < t0_ns || event.t_ns >= t1_ns;
  };
  events.erase(std::remove_if(events.begin(), events.end(), outside), events.end());
  const std::int64_t begin_ns = nanosecondsFrom(packet.timestamp);
  if (begin_ns < t0_ns) packet.timestamp = mrptTimeFrom(events.empty() ? t0_ns : events[0].t_ns);
  if (!packet.covered_until_ns) return !events.empty();
  const bool covers = *packet.covered_until_ns > t0_ns && begin_ns < t1_ns;
  packet.covered_until_ns = std::min(*packet.covered_until_ns, t1_ns);
  return !events.empty() || covers;
}

}  // namespace

TimeCut::TimeCut(std::unique_ptr<Recording> recording, std::optional<std::int64_t> t0_ns,
                 std::optional<std::int64_t> t1_ns)
    : recording_(std::move(recording)),
      t0_ns_(t0_ns.value_or(std::numeric_limits<std::int64_t>::min())),
      t1_ns_(t1_ns.value_or(std::numeric_limits<std::int64_t>::max())) {
  TimeLimits{t0_ns, t1_ns}.validate();
}

CObservation::Ptr TimeCut::next() {
  while (ready_.empty()) {
    if (!readOne()) return nullptr;
  }
  CObservation::Ptr observation = std::move(ready_.front());
  ready_.pop_front();
  return observation;
}

/// @return false once nothing can follow.
bool TimeCut::readOne() {
  const CObservation::Ptr observation =
      events_ended_ && posesEnded() ? nullptr : recording_->next();
  if (!observation) {
    const bool something_left = !began_ && !across_.empty();
    give(nullptr);
    return something_left;
  }
  const std::int64_t t_ns = nanosecondsFrom(observation->timestamp);
  if (const auto source = poseSourceOf(*observation)) {
    takePose(observation, poses_[*source], t_ns);
  } else {
    takeOther(observation, t_ns);
  }
  return true;
}

bool TimeCut::posesEnded() const {
  return !poses_.empty() && std::all_of(poses_.begin(), poses_.end(),
                                        [](const auto& entry) { return entry.second.ended; });
}

void TimeCut::takePose(const CObservation::Ptr& pose, PoseTrack& track, std::int64_t t_ns) {
  if (t_ns < t0_ns_) {
    track.before = pose;
  } else if (t_ns < t1_ns_ || !std::exchange(track.ended, true)) {
    give(pose);  // the first one after the cut is the last one needed
  }
}

void TimeCut::takeOther(const CObservation::Ptr& observation, std::int64_t t_ns) {
  if (const auto packet = std::dynamic_pointer_cast<CObservationEvents>(observation)) {
    if (t_ns >= t1_ns_) events_ended_ = true;
    if (!cutEvents(*packet, t0_ns_, t1_ns_)) return;
    if (t_ns < t0_ns_) {
      across_.push_back(packet);
    } else {
      give(packet);
    }
  } else if (t_ns >= t0_ns_ && t_ns < t1_ns_) {
    give(observation);
  }
}

/// What lies across t0 goes before everything from t0 on, and the pose before it goes first.
void TimeCut::give(const CObservation::Ptr& observation) {
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
