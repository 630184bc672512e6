// SPDX-License-Identifier: BSD-3-Clause
// Tests the mapper in live operation: wrong or excessive input costs no other data, and all is
// counted.
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <future>
#include <map>

#include "test/plugin/engine/mapper_of_rig.h"

namespace efm {
namespace {

using testing::HasSubstr;

TEST(LiveMapper, MakesTheMapOfPlaybackInGrowingSnapshotsWithTheNewestKeyframes) {
  const Samples samples = samplesOf(shaken(SyntheticRecording(1.3)));
  MapperOfRig playback(syntheticOptions());
  play(playback, samples);
  EventFusionOptions options = live();
  options.live.max_keyframes = 4;
  std::vector<std::size_t> sizes;
  Mapper::Callbacks callbacks;
  callbacks.on_map = [&](const auto& map) { sizes.push_back(map->trajectory.size()); };
  MapperOfRig mapper(options, callbacks);
  addPatiently(mapper, samples);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (mapper.snapshot()->trajectory.size() < 11 && std::chrono::steady_clock::now() < end) {
  }
  EXPECT_EQ(mapper.snapshot()->trajectory.size(), 11U) << "without further input";
  mapper.finish();

  EXPECT_GT(sizes.size(), 2U);
  for (std::size_t i = 1; i + 1 < sizes.size(); ++i) EXPECT_GT(sizes[i], sizes[i - 1]);
  const auto map = mapper.snapshot();
  const auto expected = playback.snapshot();
  ASSERT_GT(map->points->size(), 30U);
  ASSERT_EQ(map->trajectory.size(), 11U);
  expectSameMap(*map, *expected);
  ASSERT_EQ(map->keyframes.size(), 4U);
  EXPECT_EQ(mapper.driver().newest(false)->keyframes.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    const StoredKeyframe& keyframe = map->keyframes[i];
    const StoredKeyframe& other = expected->keyframes[7 + i];
    EXPECT_EQ(keyframe.t_ref_ns, other.t_ref_ns);
    EXPECT_TRUE(isSame(keyframe.T_world_ref, other.T_world_ref));
    EXPECT_EQ(keyframe.points->size(), other.points->size());
  }
  EXPECT_EQ(cv::norm(mapper.driver().newestDepth().first, playback.driver().newestDepth().first),
            0);
  const SessionStatus status = mapper.status();
  expectSumsAgree(status);
  EXPECT_EQ(status.live->dropRatio(), 0);
  EXPECT_EQ(status.live->errors, 0U) << status.live->last_error;
}

/// The mapper is stopped, or destroyed, while its thread maps and callbacks use it.
TEST(LiveMapper, StopWaitsForTheCallbackAndFinishReturnsAfterIt) {
  const Samples samples = samplesOf(SyntheticRecording(1.5));
  for (const bool finishes : {false, true}) {
    std::promise<void> within;
    std::atomic<bool> ends{false};
    std::atomic<int> calls{0};
    std::unique_ptr<Mapper> mapper;
    Mapper* user = nullptr;
    Mapper::Callbacks callbacks;
    callbacks.on_keyframe = [&](const KeyframeDepthMap&) {
      if (calls++ == 0) within.set_value();
      for (int k = 0; k < 2000; k += ends ? 1 : 0) {
        user->points();
        user->status();
        std::this_thread::sleep_for(std::chrono::microseconds(100));
      }
      ++calls;
    };
    mapper = std::make_unique<MapperOfRig>(live(), callbacks);
    user = mapper.get();
    for (const Sample& sample : samples) mapper->add(sample);
    within.get_future().wait();
    std::future<void> finished;
    ends = true;
    if (finishes) {
      finished = std::async(std::launch::async, [&] { user->finish(); });
      mapper->stop();
      ASSERT_EQ(finished.wait_for(std::chrono::seconds(60)), std::future_status::ready);
    }
    mapper.reset();
    EXPECT_EQ(calls % 2, 0) << "a callback goes on";
    EXPECT_LE(calls, 4) << "of 14 keyframes";
  }
}

TEST(LiveMapper, AHostMayDropItsLastReferenceInEachCallback) {
  struct Host {
    std::shared_ptr<Mapper> mapper;
    std::promise<void> fed;
    std::atomic<int> calls = 0;
    void drop() {
      if (++calls == 1) fed.get_future().wait();
      mapper.reset();
    }
  };
  SyntheticRecording recording;
  recording.events[1].resize(1);  // the log warns about the silent camera
  const Samples samples = samplesOf(recording);
  for (const std::string name : {"keyframe", "map", "log"}) {
    const auto host = std::make_shared<Host>();
    Mapper::Callbacks callbacks;
    if (name == "keyframe") callbacks.on_keyframe = [host](const auto&) { host->drop(); };
    if (name == "map") callbacks.on_map = [host](const auto&) { host->drop(); };
    if (name == "log") callbacks.warn = [host](const auto&) { host->drop(); };
    host->mapper = std::make_shared<MapperOfRig>(live(), callbacks);
    const std::weak_ptr<Mapper> mapper = host->mapper;
    for (const Sample& sample : samples) host->mapper->add(sample);
    host->fed.set_value();
    for (int i = 0; i < 6000 && !mapper.expired(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    EXPECT_TRUE(mapper.expired()) << name;
    EXPECT_EQ(host->calls, 1) << name;
  }
}

// --- Losses ------------------------------------------------------------------------------------

TEST(LiveMapper, TheCallerNeverWaitsAndTheNewestInputWins) {
  const SyntheticRecording recording(2);
  const Samples samples = samplesOf(recording);
  EventFusionOptions options = live();
  options.live.max_queue_events = 2500;  // more than one window, less than the recording
  std::atomic<bool> is_stopped{false};
  std::promise<void> go_on;
  Mapper::Callbacks callbacks;
  callbacks.on_keyframe = [&](const KeyframeDepthMap&) {
    if (!is_stopped.exchange(true)) go_on.get_future().wait();
  };
  MapperOfRig mapper(options, callbacks);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    mapper.add(samples[i]);
    // The queue holds the first quarter. The rest comes while the mapping is blocked.
    while (i == samples.size() / 4 && !is_stopped) std::this_thread::yield();
  }
  EXPECT_GE(mapper.driver().newest(false)->keyframes.size(), 1U);
  EXPECT_FALSE(mapper.points()->empty());
  const SessionStatus before = mapper.status();
  EXPECT_LE(before.live->cameras.at(0).queued + before.live->cameras.at(1).queued, 2500U);
  EXPECT_GT(before.live->cameras.at(0).fates[QueueFate::kQueueFull], 0U);
  go_on.set_value();
  mapper.finish();

  const SessionStatus after = mapper.status();
  expectSumsAgree(after);
  EXPECT_GT(after.counts.dropped_windows[DropReason::kOverload], 0U);
  EXPECT_EQ(after.counts.dropped_windows.total(),
            after.counts.dropped_windows[DropReason::kOverload]);
  const std::set<std::int64_t> times = timesOf(*mapper.snapshot());
  EXPECT_GT(*times.rbegin(), recording.poses.back().t_ns - 300 * kMsNs) << "the newest window";
  const std::set<std::int64_t> all = timesOf(*mapOf(syntheticOptions(), samples));
  EXPECT_TRUE(std::includes(all.begin(), all.end(), times.begin(), times.end()))
      << "no window lacks a part of its events";
}

TEST(LiveMapper, PosesWaitTenMinutesForEvents) {
  const SyntheticRecording recording(1.3);
  const auto at = [&](std::int64_t since_start_s) {
    return StampedPose{SyntheticRecording::kStartNs + since_start_s * 1000 * kMsNs,
                       recording.poses.front().T_world_rig};
  };
  for (const std::int64_t newest_s : {590, 610}) {
    SessionOfRig session(live());
    addPoses(session, recording);
    session.add(sampleOf(at(newest_s + 2)));
    EXPECT_FALSE(session.next());
    session.limitWaits();
    addEvents(session, recording);
    EXPECT_EQ(mapRest(session).size(), newest_s > 600 ? 0U : 11U);
    const EventCounts counts = session.status().counts.total();
    EXPECT_EQ(counts[EventFate::kDropped] == counts.read, newest_s > 600);
  }
  const PoseSourceId wheels{PoseKind::kOdometry, "wheels"};
  SessionOfRig session(live());
  for (std::int64_t ago_s = 7200; ago_s > 0; --ago_s) {
    session.add(sampleOf(at(ago_s == 5000 ? 4980 : -ago_s), wheels));
    EXPECT_FALSE(session.next());
    session.limitWaits();
  }
  for (const StampedPose& pose : recording.poses) session.add(sampleOf(pose, wheels));
  addEvents(session, recording);
  EXPECT_EQ(mapRest(session).size(), 11U);
  // Poses wait 600 s. The last pose without events was at 1 s before the start.
  EXPECT_EQ(session.status().poses->first_ns, at(-601).t_ns);
}

/// Returns options that are chosen from the data, and fit into a small queue.
EventFusionOptions chosenFor(int max_queue_events) {
  EventFusionOptions options = live();
  options.automatic = defaultOptions().automatic;
  options.live.max_queue_events = max_queue_events;
  return options;
}

TEST(LiveMapper, ChosenWindowsFillAtMostHalfOfTheQueue) {
  const SyntheticRecording recording(3);
  MapperOfRig mapper(chosenFor(1000));
  play(mapper, samplesOf(recording));

  const SessionStatus status = mapper.status();
  expectSumsAgree(status);
  ASSERT_EQ(status.chosen.size(), 5U);
  const auto window = std::find_if(status.chosen.begin(), status.chosen.end(),
                                   [](const auto& option) { return option.key == "window_s"; });
  ASSERT_NE(window, status.chosen.end());
  const std::string reason = window->reason;
  ASSERT_THAT(reason, testing::StartsWith("no longer one fits into half of the queue of live "
                                          "operation; from "));
  const double length_s = std::stod(reason.substr(reason.find("from ") + 5));
  const double begin_s = std::stod(reason.substr(reason.find(" at ") + 4)) -
                         1e-9 * static_cast<double>(SyntheticRecording::kStartNs);
  const double events =
      static_cast<double>(pieceOf(recording, 0, begin_s, begin_s + length_s).events.size() +
                          pieceOf(recording, 1, begin_s, begin_s + length_s).events.size());
  EXPECT_NEAR(window->value * events / length_s, 500, 10) << reason;
  EXPECT_GT(mapper.points()->size(), 30U);
  EXPECT_GT(static_cast<double>(mapper.snapshot()->trajectory.size()), 2.7 / window->value);
  EXPECT_EQ(status.counts.dropped_windows.total(), 0U) << asText(status.counts.dropped_windows);
  EXPECT_EQ(status.live->dropRatio(), 0);
}

/// The rate within a nanosecond is 1e10 events/s: a window of 0.05 us would not be allowed.
TEST(LiveMapper, OptionsAreChosenFromEventsOfOneTime) {
  SyntheticRecording recording(0.3);
  const Event event{SyntheticRecording::kStartNs + 105 * kMsNs, 60, 40, true};
  for (std::vector<Event>& events : recording.events) events.assign(10, event);
  MapperOfRig mapper(chosenFor(1000));
  play(mapper, samplesOf(recording));
  const SessionStatus status = mapper.status();
  expectSumsAgree(status);
  EXPECT_EQ(status.live->last_error, "");
}

TEST(LiveMapper, AWindowThatTheQueueCannotHoldIsShortenedIfItWasChosenOrElseAnError) {
  Samples samples = samplesOf(SyntheticRecording(3));
  for (std::size_t i = samples.size() / 2; i < samples.size(); ++i) {
    auto* const packet = std::get_if<EventPacket>(&samples[i]);
    if (packet == nullptr) continue;
    std::vector<Event> events;
    for (const Event& event : packet->events) events.insert(events.end(), 4, event);
    packet->events = CheckedEvents(std::move(events));
  }
  for (const bool is_chosen : {true, false}) {
    EventFusionOptions options = chosenFor(2000);
    options.mapper.policy.window_s = options.mapper.policy.stride_s = is_chosen ? 0.2 : 0.5;
    if (!is_chosen) options.automatic = {};
    options.live.max_event_rate = 0;
    MapperLog log;
    MapperOfRig mapper(options, log.callbacks());
    play(mapper, samples);

    const SessionStatus status = mapper.status();
    expectSumsAgree(status);
    const DroppedWindows& dropped = status.counts.dropped_windows;
    EXPECT_EQ(dropped[DropReason::kOverload], 0U) << asText(dropped);
    if (is_chosen) {
      EXPECT_EQ(dropped[DropReason::kTooLarge], 0U);
      EXPECT_EQ(status.live->errors, 0U);
      EXPECT_GT(status.choices, 1U);
      continue;
    }
    EXPECT_GE(status.counts.keyframes, 2U) << "while there were fewer events";
    EXPECT_GE(dropped[DropReason::kTooLarge], 2U) << asText(dropped);
    EXPECT_GE(status.live->errors, 1U);
    EXPECT_THAT(status.live->too_large,
                testing::MatchesRegex("a window needs [0-9]+ events, the queue holds 2000: "
                                      "expected smaller windows .*"));
    EXPECT_GE(log.count(status.live->too_large), 1U);
  }
}

TEST(LiveMapper, LossesAreLoggedWithNumbersAndLatePosesAreCounted) {
  const SyntheticRecording recording;
  EventFusionOptions options = live();
  options.live.max_event_rate = 1000;  // 10 events in 10 ms
  MapperLog log;
  MapperOfRig mapper(options, log.callbacks());
  std::vector<Event> events;
  for (int i = 0; i < 33; ++i) events.push_back({i, 1, 1, true});
  events.push_back({20 * kMsNs, 1, 1, true});
  addPatiently(mapper, {EventPacket{0, {}}, EventPacket{1, CheckedEvents(std::move(events))}});
  mapper.finish();
  ASSERT_FALSE(log.lines.empty());
  EXPECT_EQ(log.lines[0],
            "so far 0 windows dropped; camera 0: 0 dropped, 0 subsampled, 0 rejected, 0 lost "
            "afterwards, of 0 events; camera 1: 0 dropped, 23 subsampled, 0 rejected, 0 lost "
            "afterwards, of 34 events");

  MapperOfRig other(live());
  addPatiently(other, samplesOf(recording));
  other.add(sampleOf({SyntheticRecording::kStartNs - 9000 * kMsNs, {}}, {PoseKind::kPose, "pose"}));
  other.finish();
  EXPECT_EQ(other.status().live->rejected_poses, 1U);
  EXPECT_EQ(other.status().live->errors, 0U);
  EXPECT_THAT(other.status().live->last_error, HasSubstr("the pose at 1.0"));
}

TEST(LiveMapper, EventsThatWaitForPosesAreBoundedInNumberAndMemory) {
  const Samples samples = samplesOf(SyntheticRecording(1.5));
  for (const bool by_memory : {false, true}) {
    EventFusionOptions options = live();
    options.live.max_pose_wait_s = 3600;
    (by_memory ? options.live.max_queue_mb : options.live.max_event_rate) = by_memory ? 0.016 : 0;
    if (!by_memory) options.live.max_queue_events = 1000;
    MapperOfRig mapper(options);
    std::uint64_t most = 0;
    for (const Sample& sample : samples) {
      const auto* const pose = std::get_if<PoseSample>(&sample);
      if (pose != nullptr && pose->t_ns > SyntheticRecording::kStartNs + 300 * kMsNs) continue;
      addPatiently(mapper, {sample});
      const EventCounts all = mapper.status().counts.total();
      most = std::max(most, all.read - all.fates.total());
    }
    EXPECT_GT(most, 900U) << by_memory;
    EXPECT_LT(most, 1100U) << "and a packet or two: " << by_memory;
    mapper.finish();
    const SessionStatus status = mapper.status();
    expectSumsAgree(status);
    EXPECT_GT(status.counts.dropped_windows[DropReason::kOverload], 2U);
    EXPECT_GT(status.live->dropRatio(), 0.3);
  }
}

/// Each sample may be late, wrong or lost, with any schedule of the mapper's thread.
RC_GTEST_PROP(LiveMapper, EachEventHasOneFate, ()) {
  static const Samples samples = samplesOf(SyntheticRecording(0.7));
  enum { kLate = 1, kOutside, kOlder, kPaused, kLost, kJump, kTwice, kAhead, kKinds };
  const auto faults = *rc::gen::container<std::vector<int>>(
      7, rc::gen::weightedOneOf<int>({{3, rc::gen::just(0)}, {1, rc::gen::inRange(1, +kKinds)}}));
  EventFusionOptions options = live();
  options.mapper.keyframe.planes.num_planes = 4;
  options.mapper.keyframe.sweep.threads = 1;
  options.live.max_event_rate = *rc::gen::element(0.0, 1000.0);
  options.live.max_queue_events = *rc::gen::element(1000, 5'000'000);
  options.live.max_queue_mb = *rc::gen::element(0.02, 256.0);
  options.live.max_pose_wait_s = 0.2;
  options.automatic.window_s = options.automatic.stride_s = *rc::gen::arbitrary<bool>();
  MapperOfRig mapper(options);
  std::map<int, std::uint64_t> fed;
  double away_m = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const int fault = faults[i % faults.size()];
    away_m += fault == kJump ? 10 : 0;
    Sample sample = samples[i];
    auto* const packet = std::get_if<EventPacket>(&sample);
    std::vector<Event> events;
    std::optional<std::int64_t> until_ns;
    if (packet == nullptr) {
      std::get<PoseSample>(sample).T_world_body.translation.y() += away_m;
    } else {
      const std::int64_t t_ns = *packet->complete_until_ns;
      events = packet->events.all();
      if (fault == kLate) events.push_back({t_ns - 30 * kMsNs, 3, 3, true});
      if (fault == kOutside) events.push_back({t_ns, 120, 3, true});
      if (fault == kAhead) events.push_back({t_ns + 3600 * 1000 * kMsNs, 3, 3, true});
      if (fault != kOlder) until_ns = t_ns;
      for (Event& event : events) event.t_ns -= fault == kOlder ? 5000 * kMsNs : 0;
    }
    for (int times = fault == kTwice ? 2 : fault == kLost ? 0 : 1; times > 0; --times) {
      if (packet == nullptr) {
        messageOf([&] { mapper.add(sample); });
        continue;
      }
      fed[packet->camera] += events.size();
      if (fault == kPaused) {
        mapper.driver().skip(packet->camera, events);
      } else {
        messageOf([&] { mapper.driver().addEvents(packet->camera, events, until_ns); });
      }
    }
  }
  mapper.finish();
  const SessionStatus status = mapper.status();
  expectSumsAgree(status);
  RC_ASSERT(!testing::Test::HasFailure());
  std::uint64_t received = 0;
  std::uint64_t kept = 0;
  for (const auto& [camera, queue] : status.live->cameras) {
    RC_ASSERT(queue.received == fed[camera]);
    RC_ASSERT(queue.held + queue.queued == 0U);
    const EventCounts counts = countsOf(status, camera);
    received += queue.received;
    kept += counts[EventFate::kUsed] + counts[EventFate::kOutsideWindow] +
            queue.fates[QueueFate::kPaused];
  }
  RC_ASSERT(std::abs(status.live->dropRatio() * static_cast<double>(received) -
                     static_cast<double>(received - kept)) < 0.5);
}

}  // namespace
}  // namespace efm
