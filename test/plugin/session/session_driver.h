// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>
#include <vector>

#include "plugin/session/mapping_session.h"
#include "test/maps/cloud/cloud_points.h"
#include "test/plugin/session/synthetic_recording.h"
#include "test/plugin/temporary_folder.h"

namespace efm {

/// A session of the synthetic rig, with the options' time offsets.
struct SessionOfRig : MappingSession {
  explicit SessionOfRig(const EventFusionOptions& options, int num_cameras = 2)
      : MappingSession(options) {
    addCameras(calibrated({SyntheticRecording(0.001, num_cameras).cameras}, {},
                          options.rig.time_offsets_ns));
  }
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

inline void addPoses(MappingSession& session, const SyntheticRecording& recording) {
  for (const StampedPose& pose : recording.poses) session.addPose(sampleOf(pose));
}

inline void addEvents(MappingSession& session, const SyntheticRecording& recording) {
  for (int c = 0; c < static_cast<int>(recording.cameras.size()); ++c) {
    session.addEvents(packetOf(recording, c));
  }
}

inline std::vector<KeyframeDepthMap> mapDue(MappingSession& session) {
  std::vector<KeyframeDepthMap> keyframes;
  while (auto keyframe = session.next()) keyframes.push_back(std::move(*keyframe));
  return keyframes;
}

inline std::vector<KeyframeDepthMap> mapRest(MappingSession& session) {
  session.finish();
  return mapDue(session);
}

/// Adds all poses, then the events of each camera in one packet. @return all keyframes.
inline std::vector<KeyframeDepthMap> mapAll(MappingSession& session,
                                            const SyntheticRecording& recording) {
  addPoses(session, recording);
  addEvents(session, recording);
  return mapRest(session);
}

/// Adds packets of `packet_ms`, the last camera's first, and maps after each time step.
/// @return the keyframes that were made before the end of the input.
inline std::vector<KeyframeDepthMap> mapUnfinished(MappingSession& session,
                                                   const SyntheticRecording& recording,
                                                   int packet_ms) {
  std::vector<KeyframeDepthMap> keyframes;
  std::vector<std::size_t> begin(recording.cameras.size(), 0);
  for (std::size_t p = 0; p < recording.poses.size(); ++p) {
    session.addPose(sampleOf(recording.poses[p]));
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
      session.addEvents({static_cast<int>(c), CheckedEvents(std::move(part)),
                         last ? std::nullopt : std::optional(until_ns)});
    }
    std::vector<KeyframeDepthMap> made = mapDue(session);
    std::move(made.begin(), made.end(), std::back_inserter(keyframes));
  }
  return keyframes;
}

inline void mapPiecewise(MappingSession& session, const SyntheticRecording& recording,
                         int packet_ms) {
  mapUnfinished(session, recording, packet_ms);
  mapRest(session);
}

/// Expects the same keyframes at the same poses and the same points, bit for bit.
inline void expectSameMap(const MappingSession& session, const MappingSession& expected) {
  ASSERT_EQ(session.T_world_ref().size(), expected.T_world_ref().size());
  for (std::size_t i = 0; i < expected.T_world_ref().size(); ++i) {
    EXPECT_TRUE(isSame(session.T_world_ref()[i], expected.T_world_ref()[i])) << "keyframe " << i;
    EXPECT_TRUE(isSame(session.T_odom_ref()[i], expected.T_odom_ref()[i])) << "keyframe " << i;
  }
  EXPECT_EQ(session.cloud().points()->size(), expected.cloud().points()->size());
  EXPECT_TRUE(test::sameBits(*session.cloud().points(), *expected.cloud().points()));
}

}  // namespace efm
