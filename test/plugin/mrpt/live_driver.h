// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <set>
#include <thread>
#include <utility>
#include <vector>

#include "test/plugin/mrpt/observations.h"

namespace efm {

using Observations = std::vector<mrpt::obs::CObservation::Ptr>;

inline constexpr std::int64_t kMs = 1'000'000;

/// The packet in an observation; null for a pose.
inline CObservationEvents* packetIn(mrpt::obs::CObservation& observation) {
  return dynamic_cast<CObservationEvents*>(&observation);
}

inline EventFusionOptions liveOptions() {
  EventFusionOptions options = syntheticOptions();
  options.live.enabled = true;
  return options;
}

/// Feeds an observation only when the mapping has taken the one before: so nothing is given up,
/// however slow the machine is.
inline void feedPatiently(CEventFusionMapBuilder& builder, const Observations& observations) {
  const auto waits = [&] {
    const SessionStatus status = builder.status();
    if (!status.live) return false;
    for (const auto& [camera, counts] : status.live->cameras) {
      if (counts.queued > 0) return true;
    }
    return false;
  };
  for (const auto& observation : observations) {
    builder.processObservation(observation);
    while (waits()) std::this_thread::yield();
  }
}

inline void playPatiently(CEventFusionMapBuilder& builder, const Observations& observations) {
  feedPatiently(builder, observations);
  builder.finish();
}

/// Nothing is lost without a count.
/// A camera of which nothing but refused packets came is not in the rig: it has no counts.
inline EventCounts countsOf(const SessionStatus& status, int camera) {
  const auto index = static_cast<std::size_t>(camera);
  return index < status.counts.cameras.size() ? status.counts.cameras[index] : EventCounts{};
}

inline void expectSumsAgree(const SessionStatus& status) {
  for (const auto& [camera, queue] : status.live->cameras) {
    EXPECT_EQ(queue.received, queue.thinned + queue.held + queue.queued + queue.dropped +
                                  queue.paused + queue.refused + queue.after_end + queue.taken);
    const EventCounts counts = countsOf(status, camera);
    const auto refused = status.refused_events.find(camera);
    EXPECT_EQ(queue.taken,
              counts.read + (refused == status.refused_events.end() ? 0 : refused->second));
    EXPECT_EQ(counts.read, counts.used + counts.without_pose + counts.outside_window +
                               counts.dropped + counts.filtered + counts.outside_lens +
                               counts.over_budget);
  }
}

inline std::set<std::int64_t> keyframeTimes(const CEventFusionMapBuilder& builder) {
  std::set<std::int64_t> times;
  for (const StampedPose& pose : builder.trajectory()) times.insert(pose.t_ns);
  return times;
}

/// An observation with other times, or another pose.
template <typename Change>
Observations changed(Observations observations, Change change) {
  for (mrpt::obs::CObservation::Ptr& observation : observations) {
    observation =
        std::dynamic_pointer_cast<mrpt::obs::CObservation>(observation->duplicateGetSmartPtr());
    change(*observation);
  }
  return observations;
}

/// The recording announces its cameras: the empty packets at its beginning last until their first
/// events.
inline Observations announced(const SyntheticRecording& recording, Observations observations) {
  return changed(std::move(observations), [&](mrpt::obs::CObservation& observation) {
    CObservationEvents* packet = packetIn(observation);
    if (packet == nullptr || !packet->events.empty()) return;
    const auto& events = recording.events[static_cast<std::size_t>(packet->camera_index)];
    if (*packet->covered_until_ns <= events.front().t_ns) {
      packet->covered_until_ns = events.front().t_ns;
    }
  });
}

}  // namespace efm
