// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "mapping/keyframes/fusion_mapper.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "test/mapping/keyframes/random_scene.h"

namespace efm::test {

/// Maps a recording of one window: `RandomRecording` or a type with the same members.
template <typename Recording>
KeyframeDepthMap map(const Recording& recording, const std::vector<int>& cameras,
                     const KeyframeMapperOptions& options, DsiSink* sink = nullptr) {
  KeyframeMapper mapper(recording.rig, cameras, options);
  const auto keyframe =
      mapper.map(Recording::kWindow, recording.spans(), recording.trajectory, sink);
  EXPECT_TRUE(keyframe);
  return keyframe.value_or(KeyframeDepthMap());
}

/// The output of a mapper for a recording.
struct Played {
  std::vector<KeyframeDepthMap> keyframes;
  MapperCounts counts;
};

/// More than half a second of random motion and events of three cameras. As in real recordings, the
/// poses have a gap, events begin before and end after the poses, camera 1 has a time offset, and
/// many events have the same time.
struct LongRecording {
  static constexpr std::int64_t kMs = 1'000'000;
  static constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
  static constexpr std::int64_t kOffset_ns = 7 * kMs;  // of camera 1
  static constexpr double kMaxPoseGap_s = 0.05;

  Rig rig;
  std::vector<StampedPose> poses;
  std::vector<std::vector<Event>> events;  // on the cameras' own clocks

  LongRecording(std::uint32_t seed, double speed_m_s, std::size_t events_per_camera = 3000) {
    RandomScene random(seed);
    const std::int64_t gap_ns =
        kStart_ns + static_cast<std::int64_t>(random.uniform(100, 400)) * kMs;
    const Trajectory motion = random.motion(kStart_ns, 0.55, 0.2 * speed_m_s, 0.5);
    for (StampedPose pose : motion.poses()) {
      // A steady motion is added to the random motion.
      const double since_s = 1e-9 * static_cast<double>(pose.t_ns - kStart_ns);
      pose.T_world_rig.translation.x() += speed_m_s * since_s;
      if (pose.t_ns < gap_ns || pose.t_ns > gap_ns + 70 * kMs) poses.push_back(pose);
    }
    for (int c = 0; c < 3; ++c) {
      const std::int64_t offset_ns = c == 1 ? kOffset_ns : 0;
      rig.cameras.push_back({smallCamera(), random.pose(0.05, 0.1), offset_ns});
      events.push_back(
          random.events(smallCamera(), events_per_camera, kStart_ns - 20 * kMs, 600 * kMs));
      for (Event& event : events.back()) event.t_ns -= event.t_ns % 50'000;
    }
  }

  /// Returns an event's time on the trajectory's clock.
  std::int64_t timeOf(std::size_t camera, const Event& event) const {
    return event.t_ns + rig.cameras[camera].time_offset_ns;
  }
  Trajectory trajectory() const {
    Trajectory trajectory({kMaxPoseGap_s});
    for (const StampedPose& pose : poses) trajectory.add(pose);
    return trajectory;
  }
};

/// Returns options with few planes and with cameras 0 and 1 of three.
inline FusionMapperOptions playedOptions() {
  FusionMapperOptions options;
  options.trajectory.max_pose_gap_s = LongRecording::kMaxPoseGap_s;
  options.keyframe.planes = {0.5, 4.0, 4, PlaneSpacing::kInverse};
  options.keyframe.sweep.threads = 1;
  options.cameras = {0, 1};
  return options;
}

/// Gives a recording to a mapper in packets of random size and order, or as a whole if the seed is
/// 0. The recording is shorter than the 1 s after which a camera without data counts as silent.
inline Played play(const LongRecording& recording, const FusionMapperOptions& options,
                   std::uint32_t cut_seed) {
  Played played;
  FusionMapper mapper(options);
  const auto take = [&] {
    while (auto keyframe = mapper.next()) played.keyframes.push_back(std::move(*keyframe));
  };
  for (const RigCamera& camera : recording.rig.cameras) mapper.addCamera(camera);
  const std::size_t cameras = recording.events.size();
  std::vector<std::size_t> done(cameras + 1);  // events per camera, then poses
  std::mt19937 random(cut_seed);
  const auto sizeOf = [&](std::size_t stream) {
    return stream < cameras ? recording.events[stream].size() : recording.poses.size();
  };
  const auto left = [&] {
    for (std::size_t s = 0; s <= cameras; ++s) {
      if (done[s] < sizeOf(s)) return true;
    }
    return false;
  };
  while (left()) {
    const std::size_t stream = random() % (cameras + 1);
    const std::size_t most = cut_seed == 0 ? sizeOf(stream) : sizeOf(stream) / 10;
    const std::size_t size = cut_seed == 0 ? most : 1 + random() % most;
    const std::size_t end = std::min(sizeOf(stream), done[stream] + size);
    if (stream < cameras) {
      const auto begin = recording.events[stream].begin();
      mapper.addEvents(static_cast<int>(stream),
                       CheckedEvents({begin + static_cast<std::ptrdiff_t>(done[stream]),
                                      begin + static_cast<std::ptrdiff_t>(end)}));
    } else {
      for (std::size_t i = done[stream]; i < end; ++i) mapper.addPose(recording.poses[i]);
    }
    done[stream] = end;
    if (cut_seed != 0 && random() % 2 == 0) take();
  }
  mapper.finish();
  take();
  played.counts = mapper.counts();
  return played;
}

}  // namespace efm::test
