// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/mapping_session.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <set>
#include <string>

#include "mapping/geometry/timestamp.h"
#include "maps/metrics/depth_metrics.h"
#include "plugin/engine/first_look.h"
#include "test/plugin/session/session_driver.h"
#include "test/plugin/temporary_folder.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

void expectEventsAddUp(const SessionStatus& status, std::uint64_t events) {
  const EventCounts total = status.counts.total();
  EXPECT_EQ(total.read, events);
  EXPECT_EQ(total.read, total.fates.total());
}

/// Returns the median distance of the points from the dots' plane: steps of 30 planes, 1 to 5 m.
double medianErrorInSteps(MappingSession& session) {
  std::vector<DepthPair> pairs;
  const MapCloud::ConstPtr points = pointsOf(session);
  for (const MapPoint& point : *points) {
    pairs.push_back({positionIn(*points, point).z(), SyntheticRecording::kDepthM});
  }
  if (pairs.empty()) return std::numeric_limits<double>::infinity();
  return depthErrors(pairs).median_inverse / ((1.0 / 1.0 - 1.0 / 5.0) / 29);
}

TEST(MappingSession, MapsThePlaneThatTheDotsLieOnAndCountsAdd) {
  const SyntheticRecording recording;
  for (const bool live : {false, true}) {
    EventFusionOptions options = syntheticOptions();
    options.mapper.fill_last_window =
        true;  // has no effect in live operation; else the last window moves back from the end
    options.live.enabled = live;
    SessionOfRig session(options);
    EXPECT_EQ(mapAll(session, recording).size(), live ? 3U : 4U);
    ASSERT_GT(pointsOf(session)->size(), 30U);
    // In a window, dots have 8 px of parallax and are rounded to pixels. An error of half a pixel
    // is 0.5 / 8 of 1 / (2 m), a little more than one plane step.
    EXPECT_LT(medianErrorInSteps(session), 1.5);
    const MapperCounts counts = session.status().counts;
    expectEventsAddUp(session.status(), recording.totalEvents());
    EXPECT_EQ(counts.votes.total(), 30 * counts.event_uses);
    EXPECT_GT(counts.event_uses, counts.total()[EventFate::kUsed]) << "windows overlap";
    EXPECT_EQ(counts.total()[EventFate::kOutsideWindow] > 100, live);
  }
}

EventFusionOptions automaticOptions() {
  EventFusionOptions options = syntheticOptions();
  options.automatic = defaultOptions().automatic;
  options.mapper.keyframe.extraction.min_probability = 0.6;
  return options;
}

RecordingSurvey surveyOf(const SyntheticRecording& recording, const EventFusionOptions& options) {
  FirstLook surveyor(options);
  surveyor.take(Rig{recording.cameras});
  for (const StampedPose& pose : recording.poses) surveyor.addPose(sampleOf(pose));
  for (double begin_s = 0; begin_s < 5; begin_s += 0.1) {
    for (const int c : {0, 1}) surveyor.addEvents(pieceOf(recording, c, begin_s, begin_s + 0.1));
  }
  return surveyor.finish();
}

TEST(FirstLook, TakesTheSameEventsFromPacketsOfAnyLength) {
  const SyntheticRecording recording(0.5);
  std::vector<Event> events;  // 2.4 million a second: more than a look takes
  for (std::uint32_t i = 0; i < 1'200'000; ++i) {
    const std::int64_t t_ns = SyntheticRecording::kStartNs + std::int64_t{i} * 417;
    events.push_back({t_ns, std::uint16_t(i % 97 % 64), std::uint16_t(i % 89 % 48), i % 3 == 0});
  }
  std::vector<std::vector<WindowSample>> looks;
  for (const std::size_t length : {std::size_t{9001}, std::size_t{123'457}, events.size()}) {
    FirstLook look(automaticOptions());
    look.take(Rig{recording.cameras});
    for (const StampedPose& pose : recording.poses) look.addPose(sampleOf(pose));
    for (const int c : {0, 1}) {
      for (std::size_t first = 0; first < events.size(); first += length) {
        const auto begin = events.begin() + std::ptrdiff_t(first);
        const std::size_t part = std::min(length, events.size() - first);
        look.addEvents({c, CheckedEvents({begin, begin + std::ptrdiff_t(part)})});
      }
    }
    looks.push_back(look.finish().samples);
  }
  ASSERT_EQ(looks[0].size(), 1U);
  ASSERT_GT(looks[0][0].events[1].size(), 100'000U);
  for (const auto& look : looks) EXPECT_EQ(look.at(0).events, looks[0][0].events);
}

TEST(MappingSession, InPlaybackOptionsAreChosenFromTheWholeRecording) {
  for (const double duration_s : {0.5, 4.2}) {
    const SyntheticRecording recording(duration_s);
    EventFusionOptions options = automaticOptions();
    const RecordingSurvey survey = surveyOf(recording, options);
    const OptionChoice choice = chooseOptions(options.automatic, survey.rig, survey.samples,
                                              survey.duration_s, options.mapper);
    EXPECT_TRUE(choice.found_scene);
    options.automatic = {};
    SessionOfRig expected(options);
    mapAll(expected, recording);
    PlaybackSession session(automaticOptions());

    EXPECT_THAT(mapUnfinished(session, recording, 10), IsEmpty()) << "more may come";
    EXPECT_THAT(mapRest(session), Not(IsEmpty()));

    expectSameMap(*session.mapper->newest(true), *expected.snapshot(true));
    const SessionStatus status = session.mapper->status();
    ASSERT_EQ(status.chosen.size(), 5U);
    for (std::size_t i = 0; i < 5; ++i) {
      EXPECT_EQ(status.chosen[i].key, choice.options[i].key);
      EXPECT_EQ(status.chosen[i].value, choice.options[i].value);
      EXPECT_EQ(status.chosen[i].reason, choice.options[i].reason);
    }
  }
}

TEST(MappingSession, AnAutomaticVoxelIsAPixelAtTheMedianDepthAndIsChosenOnce) {
  const SyntheticRecording recording(4.2);
  const double pixel_m = SyntheticRecording::kDepthM / recording.cameras[0].model.fx;
  for (const bool live : {false, true}) {
    for (const bool has_earlier : {false, true}) {
      EventFusionOptions options = automaticOptions();
      options.automatic.voxel_size_m = true;
      options.live.enabled = live;
      std::vector<StoredKeyframe> earlier;
      if (has_earlier) {
        earlier.push_back(
            {0,
             {},
             std::make_shared<const std::vector<ViewPoint>>(1, ViewPoint{{0, 0, 1}, 1, 1, 1})});
      }
      SessionStatus status;
      double voxel_m = 0;
      if (live) {
        SessionOfRig session(options, 2, earlier);
        EXPECT_THAT(mapAll(session, recording), Not(IsEmpty()));
        status = session.status();
        voxel_m = session.options().cloud.voxel_size_m;
      } else {
        PlaybackSession session(options, earlier);
        EXPECT_THAT(mapAll(session, recording), Not(IsEmpty()));
        status = session.mapper->status();
        voxel_m = session.mapper->usedOptions().cloud.voxel_size_m;
      }
      std::vector<double> chosen_m;
      for (const ChosenOption& option : status.chosen) {
        if (option.key == "voxel_size_m") chosen_m.push_back(option.value);
      }
      if (has_earlier) {  // its points are merged already
        EXPECT_EQ(voxel_m, GlobalCloudOptions().voxel_size_m);
        EXPECT_THAT(chosen_m, IsEmpty());
      } else if (!live) {  // in live operation, the first second shows no scene
        EXPECT_THAT(chosen_m, testing::ElementsAre(voxel_m));
        EXPECT_LE(voxel_m, 1.1 * pixel_m) << "rounded down to a digit";
        EXPECT_GT(voxel_m, 0.45 * pixel_m);
      }
    }
  }
}

TEST(MappingSession, InPlaybackAStreamSaysWhatItsOptionsWereChosenFrom) {
  const SyntheticRecording recording(3.2);
  std::vector<std::int64_t> times_ns;
  for (const auto& events : recording.events) {
    for (const Event& event : events) times_ns.push_back(event.t_ns);
  }
  std::sort(times_ns.begin(), times_ns.end());
  constexpr double kMaxMb = 0.08;
  const auto fit = static_cast<std::size_t>(kMaxMb * 1e6) / sizeof(Event);
  ASSERT_GT(times_ns.size(), fit + 1000);
  for (const bool is_full : {true, false}) {
    EventFusionOptions options = automaticOptions();
    if (is_full) options.live.max_queue_mb = kMaxMb;
    PlaybackSession session(options);
    if (!is_full) session.mapper->skip(0, {{kMinTimeNs, 0, 0, false}});
    EXPECT_THAT(mapUnfinished(session, recording, 10), Not(IsEmpty())) << is_full;
    const SessionStatus status = session.mapper->status();
    ASSERT_EQ(status.chosen.size(), 5U);
    for (const ChosenOption& option : status.chosen) {
      const std::size_t at = option.reason.find("; from the first ");
      ASSERT_NE(at, std::string::npos) << option.reason;
      const double seconds = std::stod(option.reason.substr(at + 17));
      const double expected = is_full ? secondsBetween(times_ns[0], times_ns[fit]) : 1;
      EXPECT_NEAR(seconds, expected, 0.03) << "up to a packet of 10 ms: " << option.reason;
      EXPECT_THAT(option.reason,
                  testing::EndsWith(is_full ? " s of a stream, 0 MB of events ([live] max_queue_mb)"
                                            : " s of a stream"));
    }
  }
}

TEST(MappingSession, TheFirstLookAtARecordingIsNoLiveOperation) {
  SyntheticRecording recording(4.2);
  for (StampedPose& pose : recording.poses) {  // a jump after 0.7 s
    const bool is_later = pose.t_ns > SyntheticRecording::kStartNs + 700'000'000;
    pose.T_world_rig.translation.y() += is_later ? 10 : 0;
  }
  EventFusionOptions options = automaticOptions();
  options.live.enabled = true;
  const RecordingSurvey survey = surveyOf(recording, options);
  EXPECT_EQ(survey.samples.size(), 2U);  // samples of 2 s each
  EXPECT_NEAR(survey.duration_s.value_or(0), 4.2, 0.02);
}

/// The table of README.md: which windows a break drops. They are 0.2 s long and begin each 0.1 s;
/// the data come in steps of 10 ms.
TEST(MappingSession, EachBreakDropsTheWindowsThatItCuts) {
  const SyntheticRecording recording(2);
  const auto at = [](double s) { return SyntheticRecording::kStartNs + durationFromSeconds(s); };
  const struct {
    const char* what;
    Input input;    // after 1.05 s
    double from_s;  // the data go on here, on the former clock
    DropReason reason;
    double begin_s;  // of the first window behind the break
    std::uint64_t dropped;
  } rows[] = {
      // 0.9 and 1.0 s are not complete at 1.05 s. The next one begins behind the pose after.
      {"a jump", Jump{{}, at(1.05), at(1.06)}, 1.06, DropReason::kJump, 1.1, 2},
      {"a jump with a gap", Jump{{}, at(1.05), at(1.31)}, 1.31, DropReason::kJump, 1.4, 5},
      {"missing events", Missing{0, at(1.15), DropReason::kOverload}, 1.15, DropReason::kOverload,
       1.2, 3},
      {"missing events until the next ones", Missing{0, at(9), DropReason::kOverload}, 1.06,
       DropReason::kOverload, 1.1, 2},
      {"paused", Missing{0, at(1.15), DropReason::kPaused}, 1.15, DropReason::kPaused, 1.2, 3},
      // The windows of the new clock begin with its first event.
      {"a clock reset", ClockReset{}, 1.06, DropReason::kClockReset, 1.06, 2},
  };
  for (const auto& row : rows) {
    EventFusionOptions options = syntheticOptions();
    options.live.enabled = true;
    SessionOfRig session(options);
    const bool resets = std::holds_alternative<ClockReset>(row.input);
    const auto feed = [&](double from_s, double until_s) {
      for (const StampedPose& pose : recording.poses) {
        if (pose.t_ns >= at(from_s) && pose.t_ns < at(until_s)) session.add(sampleOf(pose));
      }
      for (int c = 0; c < 2; ++c) {
        EventPacket packet = pieceOf(recording, c, from_s, until_s);
        packet.complete_until_ns = at(until_s);
        session.add(std::move(packet));
      }
      return mapDue(session);
    };
    EXPECT_EQ(feed(0, 1.055).size(), 9U) << row.what;
    session.add(row.input);
    EXPECT_THAT(mapDue(session), IsEmpty()) << row.what;
    EXPECT_THAT(feed(row.from_s, row.from_s + 0.01), IsEmpty()) << row.what;
    const std::vector<KeyframeDepthMap> behind = feed(row.from_s + 0.01, 2);
    ASSERT_FALSE(behind.empty()) << row.what;
    EXPECT_NEAR(secondsBetween(SyntheticRecording::kStartNs, behind[0].window.t0_ns), row.begin_s,
                resets ? 0.01 : 0.003)
        << row.what;
    mapRest(session);
    const SessionStatus status = session.status();
    EXPECT_EQ(status.counts.dropped_windows[row.reason], row.dropped) << row.what;
    EXPECT_EQ(status.counts.dropped_windows.total(), row.dropped) << row.what;
    EXPECT_EQ(status.live->pose_jumps + status.live->clock_resets,
              std::holds_alternative<Missing>(row.input) ? 0U : 1U)
        << row.what;
    EXPECT_EQ(status.held_events, 0U);
    EXPECT_EQ(status.counts.total()[EventFate::kDropped] > 0, row.reason != DropReason::kPaused);
  }
}

/// The machine is too slow to map before the clock goes back.
TEST(MappingSession, AClockResetFirstMapsTheWindowsThatAreComplete) {
  const SyntheticRecording recording(1.3);
  SyntheticRecording later = recording;  // 100 s earlier; for 1 s the data may just be late
  constexpr std::int64_t kBackNs = 100 * kNanosecondsPerSecond;
  for (StampedPose& pose : later.poses) pose.t_ns -= kBackNs;
  for (auto& events : later.events) {
    for (Event& event : events) event.t_ns -= kBackNs;
  }
  const auto feed = [](LiveSession& session, const SyntheticRecording& part, double shift_s) {
    for (const StampedPose& pose : part.poses) session.add(sampleOf(pose));
    for (int i = 0; i < 131; ++i) {
      for (int c = 0; c < 2; ++c) {
        EventPacket packet = pieceOf(part, c, shift_s + 0.01 * i, shift_s + 0.01 * (i + 1));
        session.add(std::move(packet));
      }
    }
  };
  for (const bool is_automatic : {false, true}) {
    EventFusionOptions options = is_automatic ? automaticOptions() : syntheticOptions();
    options.live.enabled = true;
    LiveSession healthy(options);
    feed(healthy, recording, 0);
    const std::size_t complete = mapDue(healthy).size();
    EXPECT_GT(complete, is_automatic ? 0U : 8U);

    LiveSession session(options);
    session.takes = false;
    feed(session, recording, 0);
    feed(session, later, -100);
    const std::size_t made = mapRest(session).size();
    EXPECT_EQ(session.status().live->clock_resets, 1U);
    EXPECT_GE(made, complete + (is_automatic ? 0 : 1)) << "those before it, and some after it";
    EXPECT_EQ(session.status().held_events, 0U);
    std::uint64_t rejected = 0;
    for (const auto& [camera, counts] : session.gate.counts()) {
      rejected += counts.fates[QueueFate::kRejected] + counts.fates[QueueFate::kSubsampled];
    }
    expectEventsAddUp(session.status(), recording.totalEvents() + later.totalEvents() - rejected);
  }
}

TEST(MappingSession, JumpsBeforeTheChoiceOfOptionsLoseNoStretch) {
  struct Row {
    double duration_s;
    std::vector<double> jumps_s;
    std::set<std::ptrdiff_t> mapped;  // numbers of the mapped segments, from 1
    bool before_the_end;
  };
  const Row rows[] = {
      {2.4, {0.15, 0.3}, {3}, true},                 // the choice waits for the third segment
      {2.4, {0.4, 0.8, 1.2}, {1, 2, 3, 4}, true},    // chosen in the first segment
      {4.4, {1.5, 2.1, 2.7, 3.3}, {1, 4, 5}, true},  // shorter, after two without a window
      {0.9, {0.15}, {2}, false},                     // at the end, chosen from the remaining data
  };
  for (const Row& row : rows) {
    SyntheticRecording recording(row.duration_s);
    std::vector<std::int64_t> begins_ns{SyntheticRecording::kStartNs};
    for (const double jump_s : row.jumps_s) {
      begins_ns.push_back(SyntheticRecording::kStartNs + durationFromSeconds(jump_s));
    }
    const auto segmentOf = [&](std::int64_t t_ns) {
      return std::upper_bound(begins_ns.begin(), begins_ns.end(), t_ns) - begins_ns.begin();
    };
    for (StampedPose& pose : recording.poses) {
      pose.T_world_rig.translation.y() += 10.0 * static_cast<double>(segmentOf(pose.t_ns));
    }
    EventFusionOptions options = automaticOptions();
    options.live.enabled = true;
    LiveSession session(options);

    std::vector<KeyframeDepthMap> keyframes = mapUnfinished(session, recording, 10);
    EXPECT_EQ(!keyframes.empty(), row.before_the_end) << row.jumps_s[0];
    for (KeyframeDepthMap& keyframe : mapRest(session)) keyframes.push_back(std::move(keyframe));

    const std::string what = testing::PrintToString(row.jumps_s);
    EXPECT_EQ(session.status().live->pose_jumps, row.jumps_s.size()) << what;
    std::set<std::ptrdiff_t> mapped;
    for (const KeyframeDepthMap& keyframe : keyframes) {
      EXPECT_EQ(segmentOf(keyframe.window.t0_ns), segmentOf(keyframe.window.t1_ns - 1)) << what;
      mapped.insert(segmentOf(keyframe.window.t0_ns));
    }
    EXPECT_EQ(mapped, row.mapped) << what;
    EXPECT_LT(medianErrorInSteps(session), 1.5) << what;
    for (const ChosenOption& option : session.status().chosen) {
      EXPECT_THAT(option.reason, Not(HasSubstr("default"))) << what;
    }
    expectEventsAddUp(session.status(), recording.totalEvents());
  }
}

TEST(MappingSession, TheChoiceOfOptionsWaitsForAScene) {
  constexpr double kDepthM = 20;
  constexpr double kSpeedMS = 2;
  for (const double rest_s : {1.3, 10.7}) {  // shorter and longer than the choice of options waits
    const SyntheticRecording recording(rest_s + 4.3, 1, {kDepthM, kSpeedMS, rest_s, 1});
    EventFusionOptions options = automaticOptions();
    options.live.enabled = true;
    SessionOfRig session(options, 1);

    const std::vector<KeyframeDepthMap> keyframes = mapUnfinished(session, recording, 50);

    ASSERT_FALSE(keyframes.empty()) << rest_s;
    const DepthPlanesOptions& planes = keyframes.back().planes;
    const double pixel = 1 / (recording.cameras[0].model.fx * kSpeedMS);  // 1/m, in a window of 1 s
    const double step = std::max(
        pixel, (1 / planes.min_depth_m - 1 / planes.max_depth_m) / (planes.num_planes - 1));
    std::vector<DepthPair> pairs;
    for (const float depth_m : keyframes.back().map.depth) {
      if (depth_m > 0) pairs.push_back({depth_m, kDepthM});
    }
    ASSERT_GT(pairs.size(), 100U) << rest_s;
    EXPECT_LT(depthErrors(pairs).median_inverse, step) << rest_s;
    EXPECT_LT(planes.min_depth_m, kDepthM) << rest_s;
    EXPECT_GT(planes.max_depth_m, kDepthM) << rest_s;
    const SessionStatus status = session.status();
    EXPECT_EQ(status.choices, rest_s < 10 ? 1U : 2U) << "the first time without a scene";
    EXPECT_FALSE(status.scene_unknown) << rest_s;
    EXPECT_THAT(status.chosen.at(0).reason, HasSubstr("; from 1 s at ")) << rest_s;
  }
}

}  // namespace
}  // namespace efm
