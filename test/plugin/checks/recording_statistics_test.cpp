// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <functional>
#include <numeric>

#include "mapping/geometry/timestamp.h"
#include "plugin/checks/health_checks.h"
#include "plugin/checks/recording_statistics.h"
#include "plugin/session/pose_source_selector.h"
#include "plugin/session/session_status.h"

namespace efm {
namespace {

TEST(EventRate, KeepsTheRateOverAnyLengthOfTime) {
  for (const std::int64_t step_ns : {1'000LL, 10'000'000LL, 3'600'000'000'000LL}) {
    const std::int64_t start_ns = 1'700'000'000'000'000'000;
    EventRate rate;
    // 10,000 steps with one event each, then none, then two each.
    for (std::int64_t i = 0; i < 10'000; ++i) {
      const std::int64_t t_ns = start_ns + i * step_ns;
      if (i < 2500 || i >= 5000) rate.add(t_ns);
      if (i >= 5000) rate.add(t_ns);
    }
    const double step_s = 1e-9 * static_cast<double>(step_ns);
    const std::vector<double> rates = rate.over(start_ns, start_ns + 10'000 * step_ns, 40);
    for (const auto& [interval, expected] :
         std::vector<std::pair<std::size_t, double>>{{0, 1}, {8, 1}, {15, 0}, {22, 2}, {38, 2}}) {
      EXPECT_NEAR(rates[interval] * step_s, expected, 0.05) << interval << " of " << step_ns;
    }
    const double total = std::accumulate(rates.begin(), rates.end(), 0.0) * 250 * step_s;
    EXPECT_NEAR(total, 12'500, 1e-3);
  }
}

TEST(EventRate, AnEventBeforeTheFirstCountsAtTheStart) {
  EventRate rate;
  for (const std::int64_t t_ns : {5'000'000LL, 1'000'000LL, 9'000'000LL}) rate.add(t_ns);
  const std::vector<double> rates = rate.over(1'000'000, 9'000'001, 2);
  EXPECT_NEAR((rates[0] + rates[1]) * 0.004, 3, 1e-3);
  EXPECT_EQ(EventRate().over(0, 1'000, 3), std::vector<double>(3, 0.0));
}

TEST(EventRate, CountsOfABinAreInProportionToItsOverlap) {
  EventRate rate;
  EXPECT_EQ(rate.countIn(0, 5000), 0);
  for (const std::int64_t t_ns : {0, 1, 2, 3, 1024, 1025}) rate.add(10'000 + t_ns);  // 2 bins
  EXPECT_EQ(rate.countIn(10'000, 10'512), 2);
  EXPECT_EQ(rate.countIn(9'488, 10'512), 2);
  EXPECT_EQ(rate.countIn(10'512, 11'536), 2 + 1);
  EXPECT_EQ(rate.countIn(10'256, 20'000), 3 + 2);
  EXPECT_EQ(rate.countIn(9'000, 10'000), 0);
  EXPECT_EQ(rate.countIn(12'048, 20'000), 0);
}

TEST(Sparkline, HasAHeightPerValue) {
  EXPECT_EQ(sparkline({0.5, 1, 2, 3, 4, 5, 6, 7, 8}), "▁▂▃▄▅▆▇██");
  EXPECT_EQ(sparkline({0, 1, 4, 8}), " ▂▅█");
  EXPECT_EQ(sparkline({0, 0}), "  ");
}

using Times = std::vector<std::int64_t>;

const PoseSourceId kMocap = {PoseKind::kPose, "mocap"};
const PoseSourceId kSlam = {PoseKind::kPose, "slam"};
const PoseSourceId kWheels = {PoseKind::kOdometry, "wheels"};
const PoseSourceId kActions = {PoseKind::kActions, "actions"};

Times timesOf(const std::vector<StampedPose>& poses) {
  Times times;
  for (const StampedPose& pose : poses) times.push_back(pose.t_ns);
  return times;
}

/// Poses of `sources` at the times 1, 2, ..., and the times that `add` returns.
struct Poses {
  std::vector<PoseSourceId> sources;
  Times used;
};

TEST(PoseSourceSelector, TheFirstSourceOfTheBestKindOrOfTheLabelIsUsed) {
  struct Row {
    std::string label;
    Poses before;
    Times waited;  // the times that `select` returns
    Poses after;
    std::optional<PoseSourceId> selected;
    std::map<PoseSourceId, std::uint64_t> unused;
  };
  const Row rows[] = {
      {"", {{kMocap, kSlam, kMocap}, {1, 3}}, {}, {}, kMocap, {{kSlam, 1}}},
      {"", {{kActions, kWheels, kMocap}, {3}}, {}, {}, kMocap, {{kWheels, 1}, {kActions, 1}}},
      {"",
       {{kActions, kWheels, kWheels}, {}},
       {2, 3},
       {{kWheels, kMocap}, {4}},  // the map has already begun
       kWheels,
       {{kMocap, 1}, {kActions, 1}}},
      {"", {}, {}, {{kActions, kMocap}, {1}}, kActions, {{kMocap, 1}}},
      {"wheels", {{kMocap, kWheels}, {2}}, {}, {}, kWheels, {{kMocap, 1}}},
      {"gps", {{kMocap, kMocap}, {}}, {}, {}, std::nullopt, {{kMocap, 2}}},
  };
  for (const Row& row : rows) {
    PoseSourceSelector selector(row.label);
    std::int64_t t_ns = 0;
    const auto add = [&](const std::vector<PoseSourceId>& sources) {
      Times used;
      for (const PoseSourceId& source : sources) {
        for (const std::int64_t time : timesOf(selector.add(source, {++t_ns, {}}))) {
          used.push_back(time);
        }
      }
      return used;
    };
    const std::string what = "label " + row.label + ", " + testing::PrintToString(row.waited);
    EXPECT_EQ(add(row.before.sources), row.before.used) << what;
    EXPECT_EQ(timesOf(selector.select()), row.waited) << what;
    EXPECT_EQ(add(row.after.sources), row.after.used) << what;
    EXPECT_EQ(selector.selected(), row.selected) << what;
    EXPECT_EQ(selector.unused(), row.unused) << what;
  }
}

TEST(PoseSourceSelector, ForgetsWaitingPosesFarFromTheLast) {
  PoseSourceSelector selector("");
  EXPECT_EQ(selector.waitingNs(), std::nullopt);
  for (const std::int64_t t_ns : {900, 100, 150, 198, 200}) selector.add(kWheels, {t_ns, {}});
  selector.limitWaiting(50);
  EXPECT_EQ(selector.waitingNs(), 200);
  EXPECT_EQ(timesOf(selector.select()), (Times{150, 198, 200}))
      << "the first ones, far on any side";
}

using testing::HasSubstr;

constexpr std::int64_t kMsNs = 1'000'000;
const std::string kSpans =
    "the events span 10.000000000 to 10.500000000 s (+0 to +0.5 s), the poses 10.100000000 to "
    "10.600000000 s (+0.1 to +0.6 s)";

/// Returns the message. Events are at 10 to 10.5 s, poses at 10.1 to 10.6 s; a window is 1 s.
std::string why(const std::function<void(SessionStatus&, FusionMapperOptions&)>& change) {
  SessionStatus status;
  status.events = TimeSpan{10'000 * kMsNs, 10'500 * kMsNs};
  status.poses = TimeSpan{10'100 * kMsNs, 10'600 * kMsNs};
  status.counts.cameras.resize(2);
  status.counts.cameras[1].read = 10;
  FusionMapperOptions options;
  options.policy.window_s = 1;
  change(status, options);
  return whyNoKeyframe(status, options).what();
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
  EXPECT_THAT(with_poses(9'000 * kMsNs, 9'750 * kMsNs),
              HasSubstr("miss each other by 0.250000000 s"));
  EXPECT_THAT(with_poses(10'500 * kMsNs + 1, 11'000 * kMsNs), HasSubstr("other by 0.000000001 s"));
  EXPECT_THAT(with_poses(10'500 * kMsNs, 11'000 * kMsNs),
              HasSubstr(", 0.000000000 s of them togeth"));

  EXPECT_EQ(why([](auto&, auto&) {}), "no window of 1.000000000 s (window_s) was full: " + kSpans +
                                          ", 0.400000000 s of them together");
}

TEST(WhyNoKeyframe, SaysWhatTookAllEvents) {
  const auto with_counts = [](std::uint64_t filtered, std::uint64_t outside_lens,
                              std::uint64_t dropped, std::uint64_t used) {
    return why([&](auto& status, auto&) {
      EventCounts& counts = status.counts.cameras[1];
      counts[EventFate::kFiltered] = filtered;
      counts[EventFate::kOutsideLens] = outside_lens;
      counts[EventFate::kUnselected] = dropped;
      counts[EventFate::kUsed] = used;
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

TEST(TimeText, IsExactAndSaysTheDistanceFromTheStart) {
  constexpr std::int64_t kStartNs = 1'468'939'799'145'678'901;
  const std::pair<std::int64_t, const char*> cases[] = {
      {3'200'000'000, "1468939802.345678901 s (+3.2 s)"},
      {3'200'400'000, "1468939802.346078901 s (+3.2 s)"},
      {3'201'000'000, "1468939802.346678901 s (+3.201 s)"},
      {12'345'678'000'000, "1468952144.823678901 s (+12345.678 s)"},
      {0, "1468939799.145678901 s (+0 s)"},
      {-100'000, "1468939799.145578901 s (+0 s)"},
      {-1'500'000'000, "1468939797.645678901 s (-1.5 s)"}};
  for (const auto& [offset_ns, text] : cases) {
    EXPECT_EQ(timeText(kStartNs + offset_ns, kStartNs), text);
  }
  EXPECT_EQ(timeText(kStartNs, std::nullopt), "1468939799.145678901 s");
  EXPECT_EQ(timeText(10'100'000'000, 10'300'000'000, 10'000'000'000),
            "10.100000000 to 10.300000000 s (+0.1 to +0.3 s)");
  EXPECT_EQ(timeText(-500'000'000, 10'300'000'000, std::nullopt), "-0.500000000 to 10.300000000 s");
}

TEST(TimeText, DurationsAreSecondsMinutesOrHours) {
  const std::pair<double, const char*> cases[] = {
      {0, "0 s"},         {-1, "0 s"},       {59.4, "59 s"},
      {59.6, "1:00 min"}, {185, "3:05 min"}, {3599, "59:59 min"},
      {3600, "01:00 h"},  {4980, "01:23 h"}, {360'000, "100:00 h"}};
  for (const auto& [seconds, text] : cases) EXPECT_EQ(durationText(seconds), text);
}

}  // namespace

}  // namespace efm
