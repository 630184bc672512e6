// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/rig_from_packets.h"

#include <gmock/gmock.h>

#include <fstream>
#include <functional>

#include "plugin/engine/mapper_driver.h"
#include "test/plugin/mrpt/observations.h"
#include "test/plugin/temporary_folder.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kStartNs = SyntheticRecording::kStartNs;

/// Returns the events of a camera in [begin_s, end_s) as an MRPT host gives them.
CObservationEvents packetOf(const SyntheticRecording& recording, int camera, double begin_s,
                            double end_s) {
  return *observationOf(pieceOf(recording, camera, begin_s, end_s));
}

/// A mapper that is fed with packets.
struct Host {
  explicit Host(const EventFusionOptions& options)
      : mapper(MapperDriver::make(options, {})), packets(options, mapper) {}

  void addPoses(const SyntheticRecording& recording) {
    for (const StampedPose& pose : recording.poses) mapper->add(sampleOf(pose));
  }
  std::size_t keyframes() const { return mapper->newest(false)->keyframes.size(); }

  std::shared_ptr<MapperDriver> mapper;
  RigFromPackets packets;
};

TEST(RigFromPackets, ARigThatIsKnownIsMappedWithoutAWait) {
  enum class Start { kDeclared, kOffsets, kInexact };
  for (const int cameras : {1, 2}) {
    const SyntheticRecording recording(0.5, cameras);
    for (const Start start : {Start::kDeclared, Start::kOffsets, Start::kInexact}) {
      EventFusionOptions options = syntheticOptions();
      if (start == Start::kOffsets) options.rig.time_offsets_ns.resize(std::size_t(cameras));
      Host host(options);
      host.addPoses(recording);
      for (int c = 0; c < cameras; ++c) {
        CObservationEvents empty = packetOf(recording, c, 0, 0);
        empty.covered_until_ns = recording.events[std::size_t(c)].front().t_ns;
        if (start != Start::kDeclared) --*empty.covered_until_ns;
        host.packets.add(empty, true);
      }
      for (int i = 0; i < 50; ++i) {
        for (int c = 0; c < cameras; ++c) {
          host.packets.add(packetOf(recording, c, 0.01 * i, 0.01 * (i + 1)), true);
        }
      }
      EXPECT_EQ(host.keyframes(), start == Start::kInexact ? 0U : 3U) << static_cast<int>(start);
      host.packets.finish();
      host.mapper->finish();
      EXPECT_EQ(host.keyframes(), 3U);
    }
  }
}

TEST(RigFromPackets, WhatDoesNotFitTheRigIsAnErrorThatNamesIt) {
  const SyntheticRecording recording(1.2, 3);
  const struct {
    const char* error;
    int camera;
    std::function<void(CObservationEvents&)> change;
    std::function<void(EventFusionOptions&)> set;
  } kRows[] = {
      {"[rig] cameras = 5: must be a camera of the recording: 0 to 1",
       1,
       {},
       [](auto& options) { options.mapper.cameras = {5}; }},
      {"[dsi] reference_camera = 2: must be a camera of the recording: 0 to 1",
       1,
       {},
       [](auto& options) { options.mapper.keyframe.reference_camera = 2; }},
      {"[rig] time_offsets_s (how many) = 3: must be one per camera of the recording: 2",
       1,
       {},
       [](auto& options) {
         options.rig.time_offsets_ns = {0, 0, 0};
       }},
      {"camera 1 has no calibration: a map needs --calibration FILE ([rig] calibration)",
       1,
       [](auto& packet) { packet.camera.fy = 0; },
       {}},
      {"camera 0: its calibration or its pose on the rig differs from that of its first packet",
       0,
       [](auto& packet) { packet.camera.fy += 1; },
       {}},
      {"camera 1, event at 10.100000000 s: pixel (120, 0) must lie inside the sensor of 120x90",
       1,
       [](auto& packet) {
         packet.events = {{kStartNs + 100'000'000, 120, 0, true}};
       },
       {}},
      {"camera -1: must be 0 or above", 1, [](auto& packet) { packet.camera_index = -1; }, {}},
      {"the recording has events of camera 2 but none of camera 1", 2, {}, {}},
  };
  for (const auto& row : kRows) {
    EventFusionOptions options = syntheticOptions();
    if (row.set) row.set(options);
    Host host(options);
    host.addPoses(recording);
    const auto feed = [&] {
      host.packets.add(packetOf(recording, 0, 0, 0.1), true);
      CObservationEvents packet = packetOf(recording, row.camera, 0.1, 0.2);
      if (row.change) row.change(packet);
      host.packets.add(packet, true);
      host.packets.add(packetOf(recording, 0, 0.1, 1.1), true);
      host.packets.add(packetOf(recording, 0, 1.1, 1.2), true);
      host.packets.finish();
    };
    EXPECT_EQ(messageOf(feed), row.error);
    if (row.camera == 2) {
      host.mapper->finish();
      EXPECT_GT(host.keyframes(), 5U) << "the others are mapped all the same";
    }
  }
}

TEST(RigFromPackets, IsCompleteASecondAfterTheFirstEventOrWhenTheEventsFillHalfOfTheQueue) {
  const SyntheticRecording recording(1.5);
  const auto begin_s = [&](std::size_t event) {
    return 1e-9 * static_cast<double>(recording.events[0].at(event).t_ns - kStartNs);
  };
  const struct {
    bool live;
    double second_camera_s;
    bool in_time;
  } kRows[] = {{false, begin_s(0) + 0.98, true},
               {false, begin_s(0) + 1.02, false},
               {true, begin_s(450), true},
               {true, begin_s(550), false}};
  for (const auto& row : kRows) {
    EventFusionOptions options = syntheticOptions();
    options.live.enabled = row.live;
    options.live.max_queue_events = 1000;
    Host host(options);
    double t_s = 0;
    for (; t_s < row.second_camera_s; t_s += 0.01) {
      host.packets.add(packetOf(recording, 0, t_s, t_s + 0.01), true);
    }
    const std::string error =
        messageOf([&] { host.packets.add(packetOf(recording, 1, t_s, t_s + 0.1), true); });
    EXPECT_THAT(error, HasSubstr(row.in_time ? "no error" : "camera 1 first appears when the rig"))
        << row.second_camera_s;
  }
}

class CalibratedRig : public TemporaryFolder {
 protected:
  /// Returns options with a calibration of other cameras.
  EventFusionOptions optionsOf(const std::vector<RigCamera>& cameras, bool is_live) const {
    EventFusionOptions options = syntheticOptions();
    options.live.enabled = is_live;
    options.rig.calibration = folder() / "camchain.yaml";
    std::ofstream(options.rig.calibration) << formatCamchain({cameras});
    return options;
  }
};

TEST_F(CalibratedRig, HasTheCamerasOfTheOptionsAndInLiveOperationAtOnce) {
  const SyntheticRecording recording(1.3);
  std::vector<RigCamera> cameras = recording.cameras;
  cameras[0].model.cx += 1;
  cameras[1].T_rig_cam.translation.y() += 1e-3;
  for (const bool is_live : {false, true}) {
    EventFusionOptions options = optionsOf(cameras, is_live);
    options.rig.time_offsets_ns = {1000, -2000};
    Host host(options);
    host.addPoses(recording);
    host.packets.add(packetOf(recording, 0, 0, 0.1), true);
    host.packets.add(packetOf(recording, 0, 0.1, 1.2), true);
    if (!is_live) {
      EXPECT_THAT(messageOf([&] { host.packets.finish(); }), HasSubstr("2 cameras: expected 1"));
      continue;
    }
    EXPECT_NO_THROW(host.packets.add(packetOf(recording, 1, 1.2, 1.3), true))
        << "a declared camera may begin at any time";
    host.mapper->finish();
    const Rig rig = host.mapper->status().rig;
    EXPECT_NEAR(rig.cameras.at(1).T_rig_cam.translation.y(), 1e-3, 1e-12);
    EXPECT_EQ(rig.cameras[0].model.cx, recording.cameras[0].model.cx + 1);
    EXPECT_EQ(rig.cameras[1].time_offset_ns, -2000);
    CObservationEvents other = packetOf(recording, 1, 1.2, 1.3);
    other.camera.width = 240;
    EXPECT_THAT(messageOf([&] { host.packets.add(other, true); }), HasSubstr("camchain.yaml"));
  }
}

}  // namespace
}  // namespace efm
