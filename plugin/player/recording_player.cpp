// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/player/recording_player.h"

#include <mrpt/obs/CObservationRobotPose.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/mrpt/pose_observation.h"

namespace efm {
namespace {

using mrpt::obs::CObservation;

/// The interval that an observation is about, on the recording's clock.
struct Interval {
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;  // when a sensor has all of it
};

/// @return nothing for a packet without any time.
std::optional<Interval> intervalOf(const CObservationEvents& packet) {
  if (!packet.events.empty()) {
    return Interval{packet.events.front().t_ns + packet.time_offset_ns,
                    packet.events.back().t_ns + packet.time_offset_ns};
  }
  const std::optional<std::int64_t> stamp_ns = nanosecondsIfKnown(packet.timestamp);
  if (!stamp_ns) return std::nullopt;
  const std::int64_t t_ns = *stamp_ns + packet.time_offset_ns;
  return Interval{t_ns, t_ns};
}

/// @return nothing for observations that go with those around them.
std::optional<Interval> intervalOf(const CObservation& observation, std::int64_t pose_latency_ns) {
  if (const auto* packet = dynamic_cast<const CObservationEvents*>(&observation)) {
    return intervalOf(*packet);
  }
  const std::optional<std::int64_t> t_ns = nanosecondsIfKnown(observation.timestamp);
  if (!t_ns || !poseSourceOf(observation)) return std::nullopt;
  const bool late = dynamic_cast<const mrpt::obs::CObservationRobotPose*>(&observation) != nullptr;
  return Interval{*t_ns, *t_ns + (late ? pose_latency_ns : 0)};
}

}  // namespace

RecordingPlayer::RecordingPlayer(std::unique_ptr<Recording> recording, std::int64_t pose_latency_ns)
    : recording_(std::move(recording)),
      pose_latency_ns_(pose_latency_ns),
      read_until_ns_(-kEndOfTimeNs) {
  const auto is_packet = [](const auto& entry) {
    return dynamic_cast<const CObservationEvents*>(entry.second.get()) != nullptr;
  };
  auto first = waiting_.end();
  while (first == waiting_.end() && !read_all_) {
    readOne();
    first = std::find_if(waiting_.begin(), waiting_.end(), is_packet);
  }
  if (first != waiting_.end()) {
    start_ns_ = intervalOf(*first->second, 0).value_or(Interval{read_until_ns_, 0}).begin_ns;
    return;
  }
  if (error_) std::rethrow_exception(error_);
  throw std::runtime_error("the recording has no events: expected at least one");
}

std::vector<CObservation::Ptr> RecordingPlayer::observationsUntil(std::int64_t now_ns,
                                                                  std::size_t max_count) {
  std::vector<CObservation::Ptr> observations;
  while (observations.size() < max_count) {
    // What is read next may come before what waits.
    const auto first = waiting_.begin();
    if (!read_all_ && (first == waiting_.end() || first->first > read_until_ns_)) {
      readOne();
      continue;
    }
    if (first == waiting_.end() || first->first > now_ns) break;
    max_delay_ns_ = std::max(max_delay_ns_, now_ns - std::max(first->first, start_ns_));
    observations.push_back(std::move(first->second));
    waiting_.erase(first);
  }
  if (observations.empty() && waiting_.empty() && error_) std::rethrow_exception(error_);
  returned_ += observations.size();
  return observations;
}

void RecordingPlayer::readOne() {
  try {
    const CObservation::Ptr observation = recording_->next();
    if (observation) return take(observation);
  } catch (const std::exception&) {
    error_ = std::current_exception();
  }
  read_all_ = true;
}

void RecordingPlayer::take(const CObservation::Ptr& observation) {
  const auto interval = intervalOf(*observation, pose_latency_ns_);
  if (interval) read_until_ns_ = std::max(read_until_ns_, interval->begin_ns);
  waiting_.emplace(interval ? interval->end_ns : read_until_ns_, observation);
}

void shiftTimes(CObservation& observation, std::int64_t shift_ns) {
  if (const auto t_ns = nanosecondsIfKnown(observation.timestamp)) {
    observation.timestamp = mrptTimeFrom(*t_ns + shift_ns);
  }
  auto* const packet = dynamic_cast<CObservationEvents*>(&observation);
  if (packet == nullptr) return;
  for (Event& event : packet->events) event.t_ns += shift_ns;
  if (packet->covered_until_ns && *packet->covered_until_ns < kEndOfTimeNs) {
    *packet->covered_until_ns += shift_ns;
  }
}

}  // namespace efm
