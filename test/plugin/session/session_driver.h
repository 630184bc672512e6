// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>
#include <vector>

#include "plugin/engine/mapper_driver.h"
#include "plugin/session/gate.h"
#include "plugin/session/mapping_session.h"
#include "test/maps/cloud/cloud_points.h"
#include "test/plugin/session/synthetic_recording.h"
#include "test/plugin/temporary_folder.h"

namespace efm {

/// A session of the synthetic rig, with the options' time offsets.
struct SessionOfRig : MappingSession {
  explicit SessionOfRig(const EventFusionOptions& options, int num_cameras = 2,
                        const std::vector<StoredKeyframe>& earlier = {})
      : MappingSession(options, earlier) {
    add(calibrated({SyntheticRecording(0.001, num_cameras).cameras}, {},
                   options.rig.time_offsets_ns));
  }
};

/// The poses of a session's keyframes: in the map, and by the tracker.
inline std::vector<StampedPose> posesOf(MappingSession& session) {
  return session.snapshot(false)->trajectory;
}
inline std::vector<StampedPose> trackerPosesOf(MappingSession& session) {
  return session.snapshot(false)->tracker_trajectory;
}
inline MapCloud::ConstPtr pointsOf(MappingSession& session) {
  return session.snapshot(true)->points;
}

/// A mapper in playback, whose keyframes are taken like those of a session.
struct PlaybackSession {
  explicit PlaybackSession(const EventFusionOptions& options,
                           const std::vector<StoredKeyframe>& earlier = {})
      : mapper(MapperDriver::make(options, callbacks(), earlier)) {
    mapper->addCameras({SyntheticRecording(0.001).cameras});
  }
  Mapper::Callbacks callbacks() {
    Mapper::Callbacks callbacks;
    callbacks.on_keyframe = [this](const KeyframeDepthMap& keyframe) { made.push_back(keyframe); };
    return callbacks;
  }
  void add(Sample sample) { mapper->add(std::move(sample)); }
  void finish() { mapper->finish(); }

  std::vector<KeyframeDepthMap> made;
  std::shared_ptr<MapperDriver> mapper;
};

/// A session behind a gate, as in live operation, in one thread.
struct LiveSession : MappingSession {
  explicit LiveSession(const EventFusionOptions& options, int num_cameras = 2)
      : MappingSession(options), gate(options.live), most_(options.live.queueEvents()) {
    gate.add(calibrated({SyntheticRecording(0.001, num_cameras).cameras}, {},
                        options.rig.time_offsets_ns));
  }

  template <typename One>
  void add(One one) {
    gate.add(std::move(one));
    if (takes) take();
  }
  /// Takes and maps what waits, one by one.
  void take() {
    while (std::optional<Input> input = gate.take(eventsCompleteNs())) {
      try {
        MappingSession::add(std::move(*input));
      } catch (const std::invalid_argument&) {  // a pose that is not valid
        ++rejected;
      }
      map();
    }
  }
  void finish() {
    gate.end();
    take();
    MappingSession::finish();
    map();
  }
  void map() {
    limitHeld(most_);
    while (auto keyframe = next()) made.push_back(std::move(*keyframe));
    limitWaits();
  }

  Gate gate;
  bool takes = true;  ///< False: a machine that is busy.
  std::uint64_t rejected = 0;
  std::vector<KeyframeDepthMap> made;

 private:
  double most_;
};

/// Returns all events of a camera in one packet.
inline EventPacket packetOf(const SyntheticRecording& recording, int camera) {
  return {camera, CheckedEvents(recording.events[static_cast<std::size_t>(camera)])};
}

/// Returns a camera's events in [begin_s, end_s), in seconds since the recording's start.
inline EventPacket pieceOf(const SyntheticRecording& recording, int camera, double begin_s,
                           double end_s) {
  std::vector<Event> events = recording.events[static_cast<std::size_t>(camera)];
  const auto outside = [&](const Event& event) {
    const double t_s = 1e-9 * static_cast<double>(event.t_ns - SyntheticRecording::kStartNs);
    return t_s < begin_s || t_s >= end_s;
  };
  events.erase(std::remove_if(events.begin(), events.end(), outside), events.end());
  return {camera, CheckedEvents(std::move(events))};
}

/// A sink that throws at each plane, so that no keyframe is made.
struct AlwaysFailingSink : DsiSink {
  void addPlane(int /*plane*/, const float* /*values*/) override {
    throw std::runtime_error("disk full");
  }
};

/// Returns a pose of the rig as a tracker's sample.
inline PoseSample sampleOf(const StampedPose& pose, const PoseSourceId& source = {},
                           const std::optional<PoseNoise>& noise = std::nullopt) {
  return {source, pose.t_ns, pose.T_world_rig, {}, noise};
}

template <typename Session>
void addPoses(Session& session, const SyntheticRecording& recording) {
  for (const StampedPose& pose : recording.poses) session.add(sampleOf(pose));
}

template <typename Session>
void addEvents(Session& session, const SyntheticRecording& recording) {
  for (int c = 0; c < static_cast<int>(recording.cameras.size()); ++c) {
    session.add(packetOf(recording, c));
  }
}

inline std::vector<KeyframeDepthMap> mapDue(MappingSession& session) {
  std::vector<KeyframeDepthMap> keyframes;
  while (auto keyframe = session.next()) keyframes.push_back(std::move(*keyframe));
  return keyframes;
}

inline std::vector<KeyframeDepthMap> mapDue(LiveSession& session) {
  return std::exchange(session.made, {});
}
inline std::vector<KeyframeDepthMap> mapDue(PlaybackSession& session) {
  return std::exchange(session.made, {});
}

template <typename Session>
std::vector<KeyframeDepthMap> mapRest(Session& session) {
  session.finish();
  return mapDue(session);
}

/// Adds all poses, then the events of each camera in one packet. @return all keyframes.
template <typename Session>
std::vector<KeyframeDepthMap> mapAll(Session& session, const SyntheticRecording& recording) {
  addPoses(session, recording);
  addEvents(session, recording);
  return mapRest(session);
}

/// Adds packets of `packet_ms`, the last camera's first, and maps after each time step.
/// @return the keyframes that were made before the end of the input.
template <typename Session>
std::vector<KeyframeDepthMap> mapUnfinished(Session& session, const SyntheticRecording& recording,
                                            int packet_ms) {
  std::vector<KeyframeDepthMap> keyframes;
  std::vector<std::size_t> begin(recording.cameras.size(), 0);
  for (std::size_t p = 0; p < recording.poses.size(); ++p) {
    session.add(sampleOf(recording.poses[p]));
    const std::int64_t until_ns = recording.poses[p].t_ns;
    const bool last = p + 1 == recording.poses.size();
    const std::int64_t passed_ms = (until_ns - SyntheticRecording::kStartNs) / 1'000'000;
    if (passed_ms % packet_ms != 0 && !last) continue;
    for (std::size_t c = recording.cameras.size(); c-- > 0;) {
      std::vector<Event> part;
      const std::vector<Event>& events = recording.events[c];
      for (; begin[c] < events.size() && (last || events[begin[c]].t_ns < until_ns); ++begin[c]) {
        part.push_back(events[begin[c]]);
      }
      session.add(EventPacket{static_cast<int>(c), CheckedEvents(std::move(part)),
                              last ? std::nullopt : std::optional(until_ns)});
    }
    std::vector<KeyframeDepthMap> made = mapDue(session);
    std::move(made.begin(), made.end(), std::back_inserter(keyframes));
  }
  return keyframes;
}

template <typename Session>
void mapPiecewise(Session& session, const SyntheticRecording& recording, int packet_ms) {
  mapUnfinished(session, recording, packet_ms);
  mapRest(session);
}

/// Expects the same poses of all keyframes and the same points, bit for bit.
inline void expectSameMap(const MapSnapshot& map, const MapSnapshot& expected) {
  for (const auto trajectory : {&MapSnapshot::trajectory, &MapSnapshot::tracker_trajectory}) {
    const std::vector<StampedPose>& poses = map.*trajectory;
    ASSERT_EQ(poses.size(), (expected.*trajectory).size());
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const StampedPose& other = (expected.*trajectory)[i];
      EXPECT_EQ(poses[i].t_ns, other.t_ns);
      EXPECT_TRUE(isSame(poses[i].T_world_rig, other.T_world_rig)) << "keyframe " << i;
    }
  }
  EXPECT_EQ(map.points->size(), expected.points->size());
  EXPECT_TRUE(test::sameBits(*map.points, *expected.points));
}

inline void expectSameMap(MappingSession& session, MappingSession& expected) {
  expectSameMap(*session.snapshot(true), *expected.snapshot(true));
}

}  // namespace efm
