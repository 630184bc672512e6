// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/live_guard.h"

#include <gmock/gmock.h>

#include "mapping/geometry/rigid3.h"
#include "test/plugin/session/session_driver.h"

namespace efm {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000;

LiveGuard liveGuard() {
  LiveOptions options;
  options.enabled = true;
  options.max_speed_m_s = 10;
  options.max_turn_deg_s = 100;
  return LiveGuard(options);
}

NoisyPose poseOf(std::int64_t t_ms, double x_m, double turn_deg = 0, PoseNoise noise = {}) {
  NoisyPose pose{{t_ms * kMillisecond, {}}, noise};
  pose.pose.T_world_rig.translation.x() = x_m;
  pose.pose.T_world_rig.rotation =
      Eigen::AngleAxisd(turn_deg * kRadiansPerDegree, Eigen::Vector3d::UnitY());
  return pose;
}

/// The limits are 10 m/s and 100 degrees/s plus five standard deviations of the stated noise.
TEST(LiveGuard, HoldsThePosesAfterAMotionThatNothingExplains) {
  struct Row {
    NoisyPose next;  // 0.1 s after a pose at the origin
    bool is_jump;
  };
  const Row rows[] = {
      {poseOf(100, 0.99), false},
      {poseOf(100, 1.01), true},
      {poseOf(100, 1.01, 0, {0.01, 0}), false},
      {poseOf(100, 1.06, 0, {0.01, 0}), true},
      {poseOf(100, 0, 9.9), false},
      {poseOf(100, 0, 10.1), true},
      {poseOf(100, 0, -10.1), true},
      {poseOf(100, 0, 10.1, {0, 0.001}), false},
      {poseOf(200, 1.9, 19), false},
      {poseOf(0, 5), false},    // the mapper handles a second pose of the same time
      {poseOf(-50, 5), false},  // and an earlier pose
  };
  for (const Row& row : rows) {
    LiveGuard guard = liveGuard();
    const NoisyPose first = poseOf(0, 0);
    EXPECT_FALSE(guard.holdsPose(first)) << "there is none before it";
    guard.notePose(first.pose);
    const double x_m = row.next.pose.T_world_rig.translation.x();
    ASSERT_EQ(guard.holdsPose(row.next), row.is_jump) << row.next.pose.t_ns << ": " << x_m;
    ASSERT_EQ(guard.jumped(), row.is_jump);
    LiveGuard playback{LiveOptions{}};
    playback.notePose(first.pose);
    EXPECT_FALSE(playback.holdsPose(row.next));
    if (!row.is_jump) continue;
    EXPECT_TRUE(guard.holdsPose(poseOf(110, 0))) << "all that follow, though it is back";
    EXPECT_EQ(guard.beforeJumpNs(), 0);
    EXPECT_EQ(guard.afterJumpNs(), row.next.pose.t_ns);
    EXPECT_EQ(guard.beginSegment().size(), 2U);
    EXPECT_FALSE(guard.jumped());
    EXPECT_FALSE(guard.holdsPose(poseOf(500, 99))) << "a segment begins anywhere";
    EXPECT_EQ(guard.status()->pose_jumps, 1U);
  }
}

/// Returns a mapper with the recording's poses and with its events of the first half second.
FusionMapper mapperOf(const SyntheticRecording& recording) {
  FusionMapper mapper(syntheticOptions().mapper);
  for (const RigCamera& camera : recording.cameras) mapper.addCamera(camera);
  for (const StampedPose& pose : recording.poses) mapper.addPose(pose);
  for (int c = 0; c < 2; ++c) mapper.addEvents(c, pieceOf(recording, c, 0, 0.5).events);
  mapper.nextWindow();  // the windows begin at the first event
  return mapper;
}

TEST(LiveGuard, DropsTheWindowsThatNeedMissingEventsInBothModes) {
  SyntheticRecording recording(1);
  recording.cameras[1].time_offset_ns =
      -100 * kMillisecond;  // the camera's clock is ahead of the poses' clock
  const std::int64_t start_ns = SyntheticRecording::kStartNs;
  constexpr DropReason kPaused = DropReason::kPaused;
  enum class Call { kNext, kOverdue, kAll };
  struct Row {
    const char* what;
    int camera;
    std::int64_t until_ms;  // on the camera's clock, since the start
    Call call;
    std::int64_t at_ms;
    std::uint64_t windows;  // number of dropped windows of 0.2 s every 0.1 s
  };
  const Row rows[] = {
      {"until the camera's next data", 0, 400, Call::kNext, 250, 3},
      {"until the end of what is missing", 0, 250, Call::kNext, 400, 3},
      {"on its own clock", 1, 350, Call::kNext, 400, 3},
      {"a camera that is not known", 7, 400, Call::kNext, 400, 0},
      {"another camera reached it", 0, 250, Call::kOverdue, 250, 3},
      {"no camera reached it", 0, 250, Call::kOverdue, 249, 0},
      {"at the end", 0, 250, Call::kAll, 0, 3},
  };
  for (const bool live : {false, true}) {
    for (const Row& row : rows) {
      LiveGuard guard = live ? liveGuard() : LiveGuard(LiveOptions{});
      FusionMapper mapper = mapperOf(recording);
      guard.noteMissing(row.camera, {start_ns + row.until_ms * kMillisecond, kPaused});
      const std::int64_t at_ns = start_ns + row.at_ms * kMillisecond;
      for (int twice = 0; twice < 2; ++twice) {  // the second call must change nothing
        if (row.call == Call::kNext) guard.dropMissing(mapper, row.camera, at_ns);
        if (row.call == Call::kOverdue) guard.dropOverdue(mapper, at_ns);
        if (row.call == Call::kAll) guard.dropAllMissing(mapper);
      }
      EXPECT_EQ(mapper.counts().dropped_windows[DropReason::kPaused], row.windows)
          << row.what << " " << live;
    }
  }
}

TEST(LiveGuard, LateEventsAreTakenOutAndAnOlderPacketIsReported) {
  SyntheticRecording recording(1);
  recording.cameras[0].time_offset_ns = 7 * kMillisecond;
  const std::int64_t now_ns = recording.poses.back().t_ns;
  for (const bool live : {false, true}) {
    LiveGuard guard = live ? liveGuard() : LiveGuard(LiveOptions{});
    FusionMapper mapper = mapperOf(recording);
    mapper.addEvents(0, CheckedEvents({{now_ns, 1, 1, true}}));
    EventPacket mixed{
        0, CheckedEvents({{now_ns - 40 * kMillisecond, 1, 1, true}, {now_ns, 1, 1, true}})};
    EXPECT_FALSE(guard.admit(mapper, mixed));
    EXPECT_EQ(mixed.events.size(), live ? 1U : 2U);
    EXPECT_EQ(mapper.counts().late_events, live ? 1U : 0U);
    EventPacket older{0, CheckedEvents({{now_ns - 5007 * kMillisecond, 1, 1, true}})};
    const auto begin_ns = guard.admit(mapper, older);
    EXPECT_EQ(begin_ns, live ? std::optional(now_ns - 5000 * kMillisecond) : std::nullopt);
  }
}

TEST(LiveGuard, WindowsAreDroppedWhosePosesAreOverdue) {
  const SyntheticRecording recording(1);
  const std::int64_t last_ns = recording.poses.back().t_ns;
  struct Row {
    std::int64_t events_until_ms;  // since the last pose; max_pose_wait_s is 2
    bool live;
    bool drops;
  };
  for (const Row& row : {Row{2100, true, true}, {1900, true, false}, {2100, false, false}}) {
    LiveGuard guard = row.live ? liveGuard() : LiveGuard(LiveOptions{});
    FusionMapper mapper = mapperOf(recording);
    PoseSourceSelector poses("");
    guard.notePose(recording.poses.back());
    const auto needed_ns =
        guard.limitWaits(mapper, poses, TimeSpan{0, last_ns + row.events_until_ms * kMillisecond});
    EXPECT_EQ(mapper.counts().dropped_windows[DropReason::kNoPose] > 0, row.drops)
        << row.events_until_ms;
    EXPECT_EQ(needed_ns, row.live ? std::optional(last_ns - 600'000 * kMillisecond) : std::nullopt);
  }
}

TEST(LiveGuard, CountsInLiveOperationAlone) {
  LiveGuard guard = liveGuard();
  EXPECT_TRUE(guard.countRejectedPose());
  EXPECT_EQ(guard.status()->rejected_poses, 1U);
  EXPECT_TRUE(guard.fillsQueue(2'500'001)) << "half of 5,000,000";
  EXPECT_FALSE(guard.fillsQueue(2'500'000));
  LiveGuard playback{LiveOptions{}};
  EXPECT_FALSE(playback.countRejectedPose()) << "the caller's error";
  EXPECT_FALSE(playback.status());
  EXPECT_FALSE(playback.fillsQueue(9'000'000));
}

}  // namespace
}  // namespace efm
