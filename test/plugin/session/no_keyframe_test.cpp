// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/health_checks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

namespace efm {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kMsNs = 1'000'000;
const std::string kEvents = "the events span 10.000000000 to 10.500000000 s (+0 to +0.5 s)";
const std::string kSpans = kEvents + ", the poses 10.100000000 to 10.600000000 s (+0.1 to +0.6 s)";

/// Events from 10 to 10.5 s, poses from 10.1 to 10.6 s, windows of a second.
std::string why(const std::function<void(SessionStatus&, FusionMapperOptions&)>& change) {
  SessionStatus status;
  status.events = TimeSpan{10'000 * kMsNs, 10'500 * kMsNs};
  status.poses = TimeSpan{10'100 * kMsNs, 10'600 * kMsNs};
  status.counts.cameras.resize(2);
  status.counts.cameras[1].read = 10;
  FusionMapperOptions options;
  options.policy.window_s = 1;
  change(status, options);
  return whyNoKeyframe(status, options);
}

TEST(WhyNoKeyframe, SaysWhatIsMissing) {
  EXPECT_EQ(why([](auto& status, auto&) { status.events.reset(); }), "the recording has no events");
  EXPECT_EQ(why([](auto& status, auto&) { status.poses.reset(); }),
            "the recording has no poses: a map needs --poses FILE");
  EXPECT_EQ(why([](auto& status, auto&) {
              status.poses.reset();
              status.other_poses = {{{PoseKind::kPose, "mocap"}, 1},
                                    {{PoseKind::kOdometry, "wheels"}, 5},
                                    {{PoseKind::kActions, "any"}, 2}};
            }),
            "the recording has no poses of the source that [rig] pose_source says, but of poses "
            "'mocap', odometry 'wheels', actions");
}

TEST(WhyNoKeyframe, SaysTheGapBetweenPosesAndEvents) {
  const auto with_poses = [](std::int64_t first_ns, std::int64_t last_ns) {
    return why([&](auto& status, auto&) { status.poses = TimeSpan{first_ns, last_ns}; });
  };
  EXPECT_EQ(with_poses(15'000 * kMsNs, 15'400 * kMsNs),
            kEvents +
                ", the poses 15.000000000 to 15.400000000 s (+5 to +5.4 s): they miss each other "
                "by 4.500000000 s");
  EXPECT_THAT(with_poses(9'000 * kMsNs, 9'750 * kMsNs),
              HasSubstr("miss each other by 0.250000000 s"));
  EXPECT_THAT(with_poses(10'500 * kMsNs + 1, 11'000 * kMsNs), HasSubstr("other by 0.000000001 s"));
  EXPECT_THAT(with_poses(10'500 * kMsNs, 11'000 * kMsNs),
              HasSubstr(", 0.000000000 s of them togeth"));

  const auto with_limits = [](const TimeLimits& limits) {
    return why([&](auto&, auto& options) { options.limits = limits; });
  };
  const std::string no_window = "no window of 1.000000000 s (window_s) was full: " + kSpans +
                                ", 0.400000000 s of them together";
  EXPECT_EQ(with_limits({}), no_window);
  EXPECT_EQ(with_limits({10'500 * kMsNs, 10'000 * kMsNs + 1}), no_window);
  EXPECT_EQ(with_limits({10'500 * kMsNs + 1, std::nullopt}),
            "no event lies from --t0 10.500000001 s: " + kEvents);
  EXPECT_EQ(with_limits({std::nullopt, 10'000 * kMsNs}),
            "no event lies until --t1 10.000000000 s: " + kEvents);
  EXPECT_EQ(with_limits({9'000 * kMsNs, 9'500 * kMsNs}),
            "no event lies from --t0 9.000000000 s until --t1 9.500000000 s: " + kEvents);
}

TEST(WhyNoKeyframe, SaysWhatTookAllEvents) {
  const auto with_counts = [](std::uint64_t filtered, std::uint64_t outside_lens,
                              std::uint64_t dropped, std::uint64_t used) {
    return why([&](auto& status, auto&) {
      EventCounts& counts = status.counts.cameras[1];
      counts.filtered = filtered;
      counts.outside_lens = outside_lens;
      counts.dropped = dropped;
      counts.used = used;
    });
  };
  const std::string noise =
      "the filters took all 7 events of the selected cameras for noise: [filter] is too strict for "
      "this recording";
  const std::string lens =
      "5 of 10 events lie outside the lens: its model has no viewing ray for their pixels, so the "
      "calibration is wrong";
  EXPECT_EQ(with_counts(7, 0, 3, 0), noise);
  EXPECT_EQ(with_counts(3, 5, 2, 0), lens);
  for (const std::string& other :
       {with_counts(7, 0, 2, 0), with_counts(7, 0, 3, 1), with_counts(3, 5, 1, 0),
        with_counts(3, 5, 2, 1), with_counts(0, 0, 10, 0)}) {
    EXPECT_THAT(other, HasSubstr("no window of"));
  }
}

TEST(WhyNoKeyframe, SaysWhatTheWindowsLack) {
  using Policy = KeyframePolicyKind;
  const auto with_windows = [](std::uint64_t without_pose, std::uint64_t without_events, bool only,
                               Policy policy = Policy::kPeriod) {
    return why([&](auto& status, auto& options) {
      status.counts.keyframes_without_pose = without_pose;
      status.counts.windows_without_events = without_events;
      options.policy.policy = policy;
      options.policy.window_events = 7;
      if (only) options.only_window = Window{9'000 * kMsNs, 10'200 * kMsNs, 9'500 * kMsNs};
    });
  };
  EXPECT_EQ(with_windows(2, 1, false),
            "2 windows were full, but had no pose at their reference times: poses are more than "
            "max_pose_gap_s apart there");
  EXPECT_EQ(with_windows(0, 1, false),
            "the selected cameras have no event in any window that was full: " + kSpans);
  const std::string only = "the window 9.000000000 to 10.200000000 s (-1 to +0.2 s); ";
  EXPECT_EQ(with_windows(1, 1, true),
            "there is no pose at the reference time 9.500000000 s (-0.5 s) of " + only + kSpans);
  EXPECT_EQ(with_windows(0, 1, true), "the selected cameras have no event in " + only + kSpans);
  EXPECT_THAT(with_windows(0, 0, false, Policy::kEvents),
              HasSubstr("no window of 7 events (window_events) was full: "));
  EXPECT_THAT(with_windows(0, 0, false, Policy::kBaseline),
              HasSubstr("no window of at most 1.000000000 s (window_s) with motion enough "
                        "(min_baseline_ratio, min_visible_fraction) was full: "));
}

}  // namespace
}  // namespace efm
