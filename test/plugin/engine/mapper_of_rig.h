// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "plugin/engine/mapper_driver.h"
#include "test/maps/cloud/cloud_points.h"
#include "test/plugin/session/session_driver.h"
#include "test/plugin/session/synthetic_recording.h"

namespace efm {

using Samples = std::vector<Sample>;

inline constexpr std::int64_t kMsNs = 1'000'000;

/// A mapper of the synthetic rig.
struct MapperOfRig : Mapper {
  explicit MapperOfRig(const Options& options = {}, Callbacks callbacks = {},
                       const std::vector<StoredKeyframe>& earlier = {})
      : Mapper(options, std::move(callbacks), earlier) {
    addCameras({SyntheticRecording(0.001).cameras});
  }
  MapperDriver& driver() { return *driver_; }
};

/// Returns packets of 10 ms of each camera, then the pose at their end.
inline Samples samplesOf(const SyntheticRecording& recording) {
  Samples samples;
  std::vector<std::size_t> begin(recording.cameras.size(), 0);
  for (const StampedPose& pose : recording.poses) {
    for (std::size_t c = 0; c < recording.cameras.size(); ++c) {
      std::vector<Event> part;
      const std::vector<Event>& events = recording.events[c];
      for (; begin[c] < events.size() && events[begin[c]].t_ns < pose.t_ns; ++begin[c]) {
        part.push_back(events[begin[c]]);
      }
      samples.emplace_back(
          EventPacket{static_cast<int>(c), CheckedEvents(std::move(part)), pose.t_ns});
    }
    samples.emplace_back(sampleOf(pose, {PoseKind::kPose, "pose"}));
  }
  return samples;
}

inline std::size_t numEvents(const Sample& sample) {
  const auto* const packet = std::get_if<EventPacket>(&sample);
  return packet == nullptr ? 0 : packet->events.size();
}

inline EventFusionOptions live(EventFusionOptions options = syntheticOptions()) {
  options.live.enabled = true;
  return options;
}

/// Returns a camera's counts. If all its packets were rejected, the rig lacks it: all are 0.
inline EventCounts countsOf(const SessionStatus& status, int camera) {
  const auto index = static_cast<std::size_t>(camera);
  return index < status.counts.cameras.size() ? status.counts.cameras[index] : EventCounts{};
}

/// Returns how many of a camera's events the session has read or rejected.
inline std::uint64_t readOf(const SessionStatus& status, int camera) {
  const auto rejected = status.rejected_events.find(camera);
  return countsOf(status, camera).read +
         (rejected == status.rejected_events.end() ? 0 : rejected->second);
}

/// Adds a sample when the status counts all events of the samples before it. So the queue never
/// overflows, even on a slow machine, and the status after a packet does not depend on the threads.
inline void addPatiently(Mapper& mapper, const Samples& samples) {
  const auto waits = [&] {
    const SessionStatus status = mapper.status();
    return status.live && std::any_of(status.live->cameras.begin(), status.live->cameras.end(),
                                      [&](const auto& camera) {
                                        const auto& [index, queue] = camera;
                                        return queue.queued > 0 ||
                                               queue.taken != readOf(status, index);
                                      });
  };
  for (const Sample& sample : samples) {
    mapper.add(sample);
    while (waits()) std::this_thread::yield();
  }
}

inline void play(Mapper& mapper, const Samples& samples) {
  addPatiently(mapper, samples);
  mapper.finish();
}

inline std::shared_ptr<const MapSnapshot> mapOf(const EventFusionOptions& options,
                                                const Samples& samples) {
  MapperOfRig mapper(options);
  play(mapper, samples);
  return mapper.snapshot();
}

/// Expects that each event has one count in live operation.
inline void expectSumsAgree(const SessionStatus& status) {
  for (const auto& [camera, queue] : status.live->cameras) {
    EXPECT_EQ(queue.received, queue.held + queue.queued + queue.taken + queue.fates.total());
    const EventCounts counts = countsOf(status, camera);
    EXPECT_EQ(queue.taken, readOf(status, camera));
    EXPECT_EQ(counts.read, counts.fates.total());
  }
}

inline std::set<std::int64_t> timesOf(const MapSnapshot& map) {
  std::set<std::int64_t> times;
  for (const StampedPose& pose : map.trajectory) times.insert(pose.t_ns);
  return times;
}

/// The lines of a mapper's log.
struct MapperLog {
  std::vector<std::string> lines;

  /// Returns callbacks that write into this log.
  Mapper::Callbacks callbacks() {
    Mapper::Callbacks callbacks;
    callbacks.warn = callbacks.info = [this](const std::string& line) { lines.push_back(line); };
    return callbacks;
  }
  std::size_t count(const std::string& part) const {
    return static_cast<std::size_t>(std::count_if(
        lines.begin(), lines.end(),
        [&](const std::string& line) { return line.find(part) != std::string::npos; }));
  }
};

}  // namespace efm
