// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/time_cut.h"

#include <mrpt/obs/CObservationRobotPose.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "mapping/fusion_mapper.h"
#include "plugin/CObservationEvents.h"
#include "plugin/mrpt_time.h"

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
      events_ended_ && poses_ended_ ? nullptr : recording_->next();
  if (!observation) {
    const bool something_left = !began_ && !across_.empty();
    give(nullptr);
    return something_left;
  }
  const std::int64_t t_ns = nanosecondsFrom(observation->timestamp);
  if (std::dynamic_pointer_cast<mrpt::obs::CObservationRobotPose>(observation)) {
    takePose(observation, t_ns);
  } else {
    takeOther(observation, t_ns);
  }
  return true;
}

void TimeCut::takePose(const CObservation::Ptr& pose, std::int64_t t_ns) {
  if (t_ns < t0_ns_) {
    pose_before_ = pose;
  } else if (t_ns < t1_ns_ || !std::exchange(poses_ended_, true)) {
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
    if (pose_before_) ready_.push_back(std::exchange(pose_before_, nullptr));
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
