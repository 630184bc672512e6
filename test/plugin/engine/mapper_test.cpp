// SPDX-License-Identifier: BSD-3-Clause
#include "event_fusion/engine.h"

#include <gmock/gmock.h>

#include <atomic>
#include <chrono>
#include <future>
#include <new>

#include "plugin/engine/host_text.h"
#include "test/memory/failing_allocation.h"
#include "test/plugin/engine/mapper_of_rig.h"

namespace efm {
namespace {

using testing::HasSubstr;

class MapperInEitherMode : public testing::TestWithParam<bool> {
 protected:
  static bool isLive() { return GetParam(); }
  static EventFusionOptions in(EventFusionOptions options) {
    options.live.enabled = isLive();
    return options;
  }
};
INSTANTIATE_TEST_SUITE_P(Live, MapperInEitherMode, testing::Bool());

/// @return the number of samples that threw `Error`.
template <typename Error>
std::size_t addAll(Mapper& mapper, const Samples& samples) {
  std::size_t errors = 0;
  for (const Sample& sample : samples) {
    try {
      addPatiently(mapper, {sample});
    } catch (const Error&) {
      ++errors;
    }
  }
  return errors;
}

/// Expects a consistent map: its points are its keyframes' points at the poses of the trajectory.
void expectConsistent(const MapSnapshot& map, const GlobalCloudOptions& options) {
  ASSERT_EQ(map.trajectory.size(), map.keyframes.size());
  ASSERT_EQ(map.tracker_trajectory.size(), map.keyframes.size());
  GlobalCloud cloud(options);
  for (std::size_t i = 0; i < map.keyframes.size(); ++i) {
    const StoredKeyframe& keyframe = map.keyframes[i];
    EXPECT_EQ(keyframe.t_ref_ns, map.trajectory[i].t_ns);
    EXPECT_TRUE(isSame(keyframe.T_world_ref, map.trajectory[i].T_world_rig)) << "keyframe " << i;
    cloud.insert(i, pointsInWorld(*keyframe.points, keyframe.T_world_ref), keyframe.T_world_ref);
  }
  EXPECT_TRUE(test::sameBits(*cloud.points(), *map.points));
}

TEST(HostText, NamesWhatTheHostCalls) {
  const struct {
    const char* text;
    std::vector<std::string> of;  // recordings in C++ and Python, mappers in C++ and Python
  } kRows[] = {
      {"no poses: expected poses.txt, or --poses FILE",
       {"no poses: expected poses.txt, or Overrides::poses=FILE",
        "no poses: expected poses.txt, or poses=FILE", "no poses: expected poses.txt, or addPose",
        "no poses: expected poses.txt, or add_poses"}},
      {"a map needs --calibration",
       {"a map needs Overrides::calibration", "a map needs calibration=", "a map needs addCamera",
        "a map needs add_camera"}},
      {"they fit if the poses' times are in us: --pose-time-unit us; or the events' times are in a "
       "larger unit (--time-unit) (--poses)",
       {"they fit if the poses' times are in us: Overrides::pose_time_unit=us; or the events' "
        "times "
        "are in a larger unit (Overrides::time_unit) (Overrides::poses)",
        "they fit if the poses' times are in us: pose_time_unit='us'; or the events' times are in "
        "a "
        "larger unit (time_unit=) (poses=)",
        "they fit with another unit of time: are both in nanoseconds? (addPose)",
        "they fit with another unit of time: is time_unit= right for both? (add_poses)"}},
      {"--set rig.time_offsets_s=0.1,-0.1, or --set rig.calibration= keeps it",
       {"Options::set(\"rig.time_offsets_s\", \"0.1,-0.1\"), or Options::set(\"rig.calibration\", "
        "\"\") keeps it",
        "options={'rig.time_offsets_s': '0.1,-0.1'}, or options={'rig.calibration': ''} keeps it",
        "Options::set(\"rig.time_offsets_s\", \"0.1,-0.1\"), or Options::set(\"rig.calibration\", "
        "\"\") keeps it",
        "options={'rig.time_offsets_s': '0.1,-0.1'}, or options={'rig.calibration': ''} keeps it"}},
      {"(--poses, --set map.voxel_size_m=0.1)",
       {"(Overrides::poses, Options::set(\"map.voxel_size_m\", \"0.1\"))",
        "(poses=, options={'map.voxel_size_m': '0.1'})",
        "(addPose, Options::set(\"map.voxel_size_m\", \"0.1\"))",
        "(add_poses, options={'map.voxel_size_m': '0.1'})"}},
      {"stopped by a signal: there is no result",
       {"stopped: there is no result", "stopped: there is no result", "stopped: there is no result",
        "stopped: there is no result"}},
  };
  for (const auto& row : kRows) {
    for (std::size_t i = 0; i < row.of.size(); ++i) {
      hostIsPython() = i % 2 == 1;
      EXPECT_EQ(hostText(row.text, i < 2 ? HostFace::kRecording : HostFace::kMapper), row.of[i]);
    }
  }
  hostIsPython() = false;
}

TEST_P(MapperInEitherMode, AnEarlierMapStaysAndEachSnapshotOfARefinedMapIsConsistent) {
  const Samples samples = samplesOf(shaken(SyntheticRecording(1.3)));
  const EventFusionOptions options = in(refinedOptions());
  const auto first = mapOf(refinedOptions(), samples);  // mapped in playback
  const std::size_t count = first->keyframes.size();
  std::shared_ptr<Mapper> mapper;
  std::size_t delivered = 0;
  Mapper::Callbacks callbacks;
  callbacks.on_keyframe = [&](const KeyframeDepthMap& keyframe) {
    ++delivered;
    const auto map = mapper->snapshot();
    expectConsistent(*map, options.cloud);
    if (isLive()) return;
    EXPECT_EQ(map->trajectory.back().t_ns, keyframe.window.t_ref_ns);
    EXPECT_TRUE(isSame(map->trajectory.back().T_world_rig, keyframe.T_world_ref));
    EXPECT_EQ(mapper->keyframes()->points, nullptr) << "they cost an export";
  };
  callbacks.on_map = [&](const auto& map) { expectConsistent(*map, options.cloud); };
  mapper = std::make_shared<MapperOfRig>(options, callbacks, first->keyframes);
  EXPECT_EQ(mapper->snapshot()->trajectory.size(), count);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    mapper->add(samples[i]);
    if (i % 23 == 7) expectConsistent(*mapper->snapshot(), options.cloud);  // changes nothing
  }
  mapper->finish();

  EXPECT_EQ(delivered, count);
  const auto map = mapper->snapshot();
  expectConsistent(*map, options.cloud);
  ASSERT_EQ(map->trajectory.size(), 2 * count);
  const auto isAt = [](const StampedPose& pose, const StampedPose& expected) {
    return isSame(pose.T_world_rig, expected.T_world_rig);
  };
  std::size_t moved = 0;
  for (std::size_t i = 0; i < count; ++i) {
    EXPECT_TRUE(isAt(map->trajectory[i], first->trajectory[i]));
    EXPECT_TRUE(isAt(map->tracker_trajectory[i], first->trajectory[i]));
    EXPECT_TRUE(isAt(map->trajectory[count + i], first->trajectory[i]));
    EXPECT_TRUE(isAt(map->tracker_trajectory[count + i], first->tracker_trajectory[i]));
    moved += isAt(first->trajectory[i], first->tracker_trajectory[i]) ? 0 : 1;
  }
  EXPECT_GT(moved, count / 2);
}

// --- Own data ----------------------------------------------------------------------------------

/// Adds poses and events in the order of time, each camera's events of 10 ms at once.
void addInOrder(Mapper& mapper, const SyntheticRecording& recording) {
  for (const Sample& sample : samplesOf(recording)) {
    if (const auto* packet = std::get_if<EventPacket>(&sample)) {
      mapper.addEvents(packet->camera, packet->events.all());
    } else {
      const PoseSample& pose = std::get<PoseSample>(sample);
      mapper.addPose({pose.t_ns, pose.T_world_body});
    }
  }
}

TEST_P(MapperInEitherMode, OwnDataMakeTheMapOfARecording) {
  const SyntheticRecording recording(0.8);
  const auto expected = mapOf(syntheticOptions(), samplesOf(recording));
  Mapper mapper(in(syntheticOptions()));
  for (const RigCamera& camera : recording.cameras) mapper.addCamera(camera);
  addInOrder(mapper, recording);
  if (!isLive()) {
    EXPECT_GT(mapper.trajectory().size(), 1U) << "it waits for no further camera";
  }
  mapper.finish();
  expectSameMap(*mapper.snapshot(), *expected);
  EXPECT_THROW(mapper.addCamera(recording.cameras[0]), std::logic_error);
  EXPECT_THROW(mapper.addEvents(2, {}), std::invalid_argument);
  EXPECT_TRUE(mapper.warnings().empty()) << mapper.warnings()[0].text;
}

TEST(Mapper, OwnDataMayComeInAnyOrderOfSensors) {
  SyntheticRecording recording(0.8);
  for (auto& events : recording.events) {  // `samplesOf` ends with the last pose, too
    while (events.back().t_ns >= recording.poses.back().t_ns) events.pop_back();
  }
  for (const bool is_chosen : {false, true}) {
    EventFusionOptions options = syntheticOptions();
    if (is_chosen) options.automatic = defaultOptions().automatic;
    const auto expected = mapOf(options, samplesOf(recording));
    for (const bool poses_first : {false, true}) {
      Mapper mapper(options);
      for (const RigCamera& camera : recording.cameras) mapper.addCamera(camera);
      const auto add_poses = [&] {
        for (const StampedPose& pose : recording.poses) mapper.addPose(pose);
      };
      if (poses_first) add_poses();
      mapper.addEvents(1, recording.events[1]);
      mapper.addEvents(0, recording.events[0]);
      if (!poses_first) add_poses();
      mapper.finish();
      expectSameMap(*mapper.snapshot(), *expected);
    }
  }
}

TEST(Mapper, BurstsOfWrongTimesInOwnDataAreLeftOutAndTold) {
  const SyntheticRecording recording(0.8);
  const auto expected = mapOf(syntheticOptions(), samplesOf(recording));
  for (const std::size_t at : {std::size_t{0}, std::size_t{600}, recording.events[0].size()}) {
    std::vector<Event> events = recording.events[0];
    const Event& beside = events[std::min(at, events.size() - 1)];
    for (std::int64_t i = 0; i < 50; ++i) {
      const std::int64_t t_ns = beside.t_ns + 100'000 * kMsNs + 100'000 * i;
      events.insert(events.begin() + std::ptrdiff_t(at) + i, {t_ns, 5, 5, true});
    }
    Mapper mapper(syntheticOptions());
    for (const RigCamera& camera : recording.cameras) mapper.addCamera(camera);
    for (const StampedPose& pose : recording.poses) mapper.addPose(pose);
    for (std::size_t first = 0; first < events.size(); first += 100) {
      const auto begin = events.begin() + std::ptrdiff_t(first);
      mapper.addEvents(
          0, {begin, begin + std::ptrdiff_t(std::min<std::size_t>(100, events.size() - first))});
    }
    mapper.addEvents(1, recording.events[1]);
    mapper.finish();
    expectSameMap(*mapper.snapshot(), *expected);
    ASSERT_EQ(mapper.warnings().size(), 1U) << at;
    EXPECT_EQ(mapper.warnings()[0].name, "skipped-events");
    EXPECT_THAT(mapper.warnings()[0].text, testing::StartsWith("50 bad events were left out"));
  }
}

TEST(Mapper, OwnDataMayComeFromAThreadPerSensor) {
  const SyntheticRecording recording(0.8);
  const auto expected = mapOf(syntheticOptions(), samplesOf(recording));
  Mapper mapper(syntheticOptions());
  for (const RigCamera& camera : recording.cameras) mapper.addCamera(camera);
  std::vector<std::thread> sensors;
  for (int camera : {0, 1}) {
    sensors.emplace_back([&, camera] {
      for (const Sample& sample : samplesOf(recording)) {
        const auto* const packet = std::get_if<EventPacket>(&sample);
        if (packet && packet->camera == camera) mapper.addEvents(camera, packet->events.all());
      }
    });
  }
  for (const StampedPose& pose : recording.poses) mapper.addPose(pose);
  for (std::thread& sensor : sensors) sensor.join();
  mapper.finish();
  expectSameMap(*mapper.snapshot(), *expected);
}

TEST_P(MapperInEitherMode, WarningsSayWhyThereIsNoKeyframe) {
  const SyntheticRecording recording;
  const auto last_warning = [&](bool has_events, bool has_poses) {
    EventFusionOptions options = in(syntheticOptions());
    options.mapper.policy.window_s = 2;
    Mapper mapper(options);
    EXPECT_TRUE(mapper.warnings().empty()) << "more data may come";
    for (const RigCamera& camera : recording.cameras) mapper.addCamera(camera);
    for (const StampedPose& pose : recording.poses) {
      if (has_poses) mapper.addPose(pose);
    }
    for (int c = 0; has_events && c < 2; ++c) mapper.addEvents(c, recording.events[std::size_t(c)]);
    mapper.finish();
    return mapper.warnings().front();
  };
  EXPECT_EQ(last_warning(false, true).name, "no-keyframe");
  EXPECT_THAT(last_warning(false, true).text, HasSubstr("no events"));
  EXPECT_THAT(last_warning(true, false).text, HasSubstr("no poses"));
  EXPECT_THAT(last_warning(true, true).text, HasSubstr("no window of 2.000000000 s"));
}

// --- Pause and end -----------------------------------------------------------------------------

/// Holds if the mapping keeps up, and if it gets most of the input at once.
TEST_P(MapperInEitherMode, SkippedPacketsAreCountedAndTheirWindowsDropped) {
  const Samples samples = samplesOf(SyntheticRecording(3));  // three samples per 10 ms
  for (const bool at_once : {false, isLive()}) {
    std::uint64_t fed = 0;
    std::promise<void> all_fed;
    Mapper::Callbacks callbacks;
    callbacks.on_keyframe = [&, wait = at_once](const KeyframeDepthMap&) mutable {
      if (std::exchange(wait, false)) all_fed.get_future().wait();
    };
    MapperOfRig mapper(in(syntheticOptions()), callbacks);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      fed += numEvents(samples[i]);
      const auto* const packet = std::get_if<EventPacket>(&samples[i]);
      if (packet != nullptr && i >= 450 && i < 750) {
        mapper.driver().skip(packet->camera, packet->events.all());
      } else if (at_once) {
        mapper.add(samples[i]);
      } else {
        addPatiently(mapper, {samples[i]});
      }
    }
    all_fed.set_value();
    mapper.finish();

    const std::set<std::int64_t> times = timesOf(*mapper.snapshot());
    for (const std::int64_t t_ns : times) {
      const double t_s = 1e-9 * static_cast<double>(t_ns - SyntheticRecording::kStartNs);
      EXPECT_TRUE(t_s < 1.4 || t_s > 2.6) << t_s << " s: in the middle of a window of 0.2 s";
    }
    EXPECT_EQ(times.size(), 13U + 3U) << at_once;
    const SessionStatus status = mapper.status();
    std::uint64_t paused = 0;
    for (const auto& [camera, count] : status.paused_events) paused += count;
    if (isLive())
      paused = status.live->cameras.at(0).fates[QueueFate::kPaused] +
               status.live->cameras.at(1).fates[QueueFate::kPaused];
    EXPECT_GT(paused, 0U);
    EXPECT_EQ(paused + status.counts.total().read, fed);
    EXPECT_EQ(status.counts.dropped_windows.total(),
              status.counts.dropped_windows[DropReason::kPaused]);
  }
}

TEST_P(MapperInEitherMode, InputAfterTheEndChangesNothing) {
  const Samples samples = samplesOf(SyntheticRecording());
  MapperOfRig mapper(in(syntheticOptions()));
  play(mapper, samples);
  const auto map = mapper.snapshot();
  std::uint64_t events = 0;
  std::uint64_t poses = 0;
  for (const Sample& sample : samples) {
    events += numEvents(sample);
    poses += std::holds_alternative<PoseSample>(sample) ? 1 : 0;
    const std::string error = messageOf([&] { mapper.add(sample); });
    EXPECT_THAT(error, HasSubstr(isLive() ? "no error" : "input after the end"));
  }
  EXPECT_EQ(messageOf([&] { mapper.finish(); }).empty(), false);
  expectSameMap(*mapper.snapshot(), *map);
  const SessionStatus status = mapper.status();
  EXPECT_EQ(status.counts.total().read, events);
  if (!isLive()) return;
  expectSumsAgree(status);
  EXPECT_EQ(status.live->cameras.at(0).fates[QueueFate::kAfterEnd] +
                status.live->cameras.at(1).fates[QueueFate::kAfterEnd],
            events);
  EXPECT_EQ(status.live->rejected_poses, poses);
  EXPECT_DOUBLE_EQ(status.live->dropRatio(), 0.5);
}

TEST_P(MapperInEitherMode, StopInACallbackEndsTheMapping) {
  std::shared_ptr<MapperOfRig> mapper;
  std::atomic<int> calls{0};
  Mapper::Callbacks callbacks;
  callbacks.on_keyframe = [&](const KeyframeDepthMap&) {
    ++calls;
    EXPECT_EQ(mapper->driver().runsHere(), isLive());
    if (isLive()) {
      EXPECT_THROW(mapper->finish(), std::logic_error) << "it would wait for itself";
    }
    mapper->stop();
  };
  mapper = std::make_shared<MapperOfRig>(in(syntheticOptions()), callbacks);
  for (const Sample& sample : samplesOf(SyntheticRecording())) mapper->add(sample);
  mapper->finish();
  EXPECT_EQ(calls, 1) << "of three";
  EXPECT_EQ(mapper->status().counts.keyframes, 1U);
}

TEST(Mapper, InPlaybackAHostMayDropItsLastReferenceInAKeyframesCallback) {
  const Samples samples = samplesOf(SyntheticRecording());
  for (const bool in_finish : {false, true}) {
    EventFusionOptions options = syntheticOptions();
    if (in_finish) options.automatic = defaultOptions().automatic;  // nothing is mapped before
    std::shared_ptr<MapperOfRig> mapper;
    int calls = 0;
    Mapper::Callbacks callbacks;
    callbacks.on_keyframe = [&](const KeyframeDepthMap&) {
      ++calls;
      mapper.reset();
    };
    mapper = std::make_shared<MapperOfRig>(options, callbacks);
    for (const Sample& sample : samples) {
      if (mapper) mapper->add(sample);
    }
    EXPECT_EQ(mapper == nullptr, !in_finish);
    if (mapper) mapper->finish();
    EXPECT_EQ(mapper, nullptr);
    EXPECT_EQ(calls, 1) << "the mapper has ended";
  }
}

TEST(Mapper, WarningsAreOfTheEventsThatWereTakenAndOfPosesInAnyOrder) {
  const SyntheticRecording recording(0.8);
  Mapper mapper(syntheticOptions());
  for (const RigCamera& camera : recording.cameras) mapper.addCamera(camera);
  for (auto pose = recording.poses.rbegin(); pose != recording.poses.rend(); ++pose) {
    mapper.addPose(*pose);  // within a second
  }
  for (int c = 0; c < 2; ++c) mapper.addEvents(c, recording.events[std::size_t(c)]);
  EXPECT_THROW(mapper.addEvents(0, {{kMsNs * 1'000'000, 9999, 0, true}}), std::invalid_argument);
  mapper.finish();
  EXPECT_THAT(mapper.warnings(), testing::IsEmpty()) << mapper.warnings()[0].text;
  EXPECT_GT(mapper.trajectory().size(), 1U);
}

// --- Errors ------------------------------------------------------------------------------------

TEST_P(MapperInEitherMode, ErrorsOfCallbacksAreCountedOrTheFirstIsThrown) {
  SyntheticRecording recording;
  recording.events[1].clear();  // the log warns about it before the first keyframe is given
  const Samples samples = samplesOf(recording);
  const EventFusionOptions options = in(syntheticOptions());
  const auto expected = mapOf(options, samples);
  for (const bool log_throws : {false, true}) {
    std::shared_ptr<MapperOfRig> mapper;
    MapperLog log;
    std::size_t thrown = 0;
    std::size_t keyframes = 0;
    const auto madeKeyframes = [&] {  // another thread may query, too
      const auto ask = [&] { return mapper->status().counts.keyframes; };
      return std::async(std::launch::async, ask).get();
    };
    Mapper::Callbacks callbacks;
    callbacks.warn = [&](const std::string& text) {
      log.lines.push_back(text);
      EXPECT_GE(madeKeyframes(), isLive() ? 0U : 1U);
      if (log_throws && ++thrown > 0) throw std::runtime_error("the log is full");
    };
    callbacks.on_keyframe = [&](const KeyframeDepthMap&) {
      EXPECT_EQ(madeKeyframes(), ++keyframes) << "the next one is made later";
      EXPECT_TRUE(isLive() || mapper->driver().newest(false)->keyframes.size() == keyframes);
      ++thrown;
      throw std::runtime_error("keyframe " + std::to_string(keyframes));
    };
    callbacks.on_map = [&](const auto&) {
      ++thrown;
      throw 5;
    };
    mapper = std::make_shared<MapperOfRig>(options, callbacks);
    std::string error = "no error";
    const auto noteFirst = [&](const auto& call) {
      const std::string text = messageOf(call);
      if (error == "no error") error = text;
    };
    for (const Sample& sample : samples) noteFirst([&] { addPatiently(*mapper, {sample}); });
    noteFirst([&] { mapper->finish(); });

    EXPECT_EQ(error, isLive() ? "no error" : log_throws ? "the log is full" : "keyframe 1");
    EXPECT_EQ(keyframes, 3U) << "after an error of the log, too";
    expectSameMap(*mapper->snapshot(), *expected);
    EXPECT_EQ(log.count("camera 1 had no event"), 1U);
    EXPECT_EQ(log.count("the callback of a keyframe: "), isLive() ? 1U : 0U);
    EXPECT_EQ(log.count("the callback of the map: an exception of another type"),
              isLive() ? 1U : 0U);
    EXPECT_EQ(log.count("the callback of the log: the log is full"),
              isLive() && log_throws ? 1U : 0U);
    if (!isLive()) continue;
    EXPECT_EQ(mapper->status().live->errors, thrown);
  }
}

/// After an error, live operation continues with the next window, playback with the same window.
TEST_P(MapperInEitherMode, AfterAnErrorOfTheSinkTheMappingGoesOn) {
  struct FullDisk : DsiSink {
    std::atomic<int> planes{0};
    int last = isLive() ? 40 : 1'000'000'000;
    void addPlane(int /*plane*/, const float* /*values*/) override {
      if (const int number = planes++; number >= 40 && number <= last) {
        throw std::runtime_error("the disk is full");
      }
    }
  } disk;
  const SyntheticRecording recording;
  const Samples samples = samplesOf(recording);
  std::size_t delivered = 0;
  Mapper::Callbacks callbacks;
  callbacks.on_keyframe = [&](const KeyframeDepthMap&) { ++delivered; };
  MapperOfRig mapper(in(syntheticOptions()), callbacks);
  mapper.driver().setSink(&disk);
  const std::size_t errors = addAll<std::runtime_error>(mapper, samples);
  if (!isLive()) {
    EXPECT_GT(errors, 10U) << "each sample tries the window again";
    EXPECT_EQ(delivered, 1U);
    EXPECT_EQ(mapper.snapshot()->trajectory.size(), 1U);
    EXPECT_EQ(mapper.status().counts.keyframes, 1U);
    mapper.driver().setSink(nullptr);
  }
  mapper.finish();
  const auto expected = mapOf(syntheticOptions(), samples);
  if (!isLive()) return expectSameMap(*mapper.snapshot(), *expected);
  const SessionStatus status = mapper.status();
  expectSumsAgree(status);
  EXPECT_EQ(status.live->errors, 1U);
  EXPECT_THAT(status.live->last_error, HasSubstr("the disk is full"));
  EXPECT_EQ(status.counts.dropped_windows[DropReason::kError], 1U);
  EXPECT_EQ(delivered, 2U) << "of three";
  std::set<std::int64_t> times = timesOf(*expected);
  times.erase(std::next(times.begin()));
  EXPECT_EQ(timesOf(*mapper.snapshot()), times);
}

TEST_P(MapperInEitherMode, IfMemoryEndsKeyframesAndPointsStayConsistent) {
  struct FailingSink : DsiSink {
    std::size_t skipped = std::size_t(-1);
    int keyframes = 0;
    void addPlane(int plane, const float* /*values*/) override {
      if (plane == 29 && ++keyframes == 2) failAllocation(Allocating::kThisThread, skipped);
    }
  };
  const Samples samples = samplesOf(SyntheticRecording());
  EventFusionOptions options = in(syntheticOptions());
  options.mapper.keyframe.sweep.threads = 1;  // the mapping thread calls the sink
  const auto run = [&](std::size_t skipped) {
    FailingSink sink;
    sink.skipped = skipped;
    std::vector<std::size_t> allocations;
    Mapper::Callbacks callbacks;
    callbacks.on_keyframe = [&](const KeyframeDepthMap&) {
      if (sink.keyframes == 2) allocations = stopFailing();
    };
    MapperOfRig mapper(options, callbacks);
    mapper.driver().setSink(&sink);
    std::size_t errors = addAll<std::bad_alloc>(mapper, samples);
    mapper.finish();
    stopFailing();

    const SessionStatus status = mapper.status();
    if (isLive()) errors = status.live->errors;
    EXPECT_LE(errors, skipped == std::size_t(-1) ? 0U : 1U);
    const auto map = mapper.snapshot();
    EXPECT_GE(map->keyframes.size(), 2U) << "of three";
    EXPECT_EQ(status.counts.keyframes, map->keyframes.size());
    expectConsistent(*map, options.cloud);
    return allocations;
  };
  const std::vector<std::size_t> rare = rareOnes(run(std::size_t(-1)));
  ASSERT_GT(rare.size(), 10U);
  for (std::size_t i = 0; i < rare.size(); i += rare.size() / 30 + 1) {
    SCOPED_TRACE("allocation " + std::to_string(rare[i]));
    run(rare[i]);
    if (HasFailure()) return;
  }
}

// --- Threads -----------------------------------------------------------------------------------

/// A sink that queries the mapper from other threads during the first sweep.
struct QueryingSink : DsiSink {
  std::vector<std::function<void()>> queries;
  std::chrono::milliseconds patience{150};
  std::size_t answered = 0;  ///< Number of queries answered during the sweep.
  std::atomic<bool> has_asked{false};
  std::vector<std::future<void>> answers;

  void addPlane(int /*plane*/, const float* /*values*/) override {
    if (has_asked.exchange(true)) return;
    for (const auto& ask : queries) answers.push_back(std::async(std::launch::async, ask));
    const auto until = std::chrono::steady_clock::now() + patience;
    for (auto& answer : answers) {
      answered += answer.wait_until(until) == std::future_status::ready ? 1 : 0;
    }
  }
};

TEST_P(MapperInEitherMode, QueriesAreAnsweredDuringASweepInLiveOperationAlone) {
  QueryingSink sink;
  MapperOfRig mapper(in(syntheticOptions()));
  sink.queries = {[&] { mapper.status(); }, [&] { mapper.points(); }, [&] { mapper.keyframes(); },
                  [&] { mapper.driver().newest(false); }};
  if (isLive()) sink.queries.emplace_back([&] { mapper.driver().skip(0, {}); });
  if (isLive()) sink.patience = std::chrono::seconds(60);
  mapper.driver().setSink(&sink);
  play(mapper, samplesOf(SyntheticRecording()));
  sink.answers.clear();  // waits for the query threads
  EXPECT_EQ(sink.answered, isLive() ? sink.queries.size() : 0U);
}

TEST(Mapper, PlaybackMapsInputFromACallbackAfterIt) {
  const Samples samples = samplesOf(SyntheticRecording());
  std::size_t next = 0;
  int running = 0;
  int delivered = 0;
  std::unique_ptr<Mapper> mapper;
  Mapper::Callbacks callbacks;
  callbacks.on_keyframe = [&](const KeyframeDepthMap&) {
    EXPECT_EQ(++running, 1) << "a callback within a callback";
    for (++delivered; next < samples.size(); ++next) mapper->add(samples[next]);
    --running;
  };
  mapper = std::make_unique<MapperOfRig>(syntheticOptions(), callbacks);
  while (next < samples.size()) mapper->add(samples[next++]);
  EXPECT_EQ(delivered, 3) << "before the call returns";
  mapper->finish();
  expectSameMap(*mapper->snapshot(), *mapOf(syntheticOptions(), samples));
}

TEST_P(MapperInEitherMode, ThreadsMayAddAndAsk) {
  // All poses come first. Then one thread per camera adds the events.
  const Samples samples = samplesOf(shaken(SyntheticRecording(0.9)));
  for (const bool is_refined : {false, true}) {
    EventFusionOptions options = refinedOptions();
    options.refinement.enabled = is_refined;
    options.refinement.background = false;
    const auto expected = mapOf(options, samples);
    options.refinement.background = true;
    std::atomic<std::size_t> delivered = 0;
    Mapper::Callbacks callbacks;
    callbacks.on_keyframe = [&](const KeyframeDepthMap&) { ++delivered; };
    MapperOfRig mapper(in(options), callbacks);
    std::vector<EventPacket> packets;
    for (const Sample& sample : samples) {
      const auto* const packet = std::get_if<EventPacket>(&sample);
      packet != nullptr ? packets.push_back(*packet) : mapper.add(sample);
    }
    std::vector<std::thread> feeders;
    for (const std::size_t camera : {0U, 1U}) {
      feeders.emplace_back([&, camera] {
        for (std::size_t i = camera; i < packets.size(); i += 2) mapper.add(packets[i]);
      });
    }
    std::atomic<bool> done = false;
    std::thread querier([&] {
      while (!done) {
        expectConsistent(*mapper.snapshot(), options.cloud);
        mapper.status();
        mapper.driver().newestDepth();
      }
    });
    for (std::thread& feeder : feeders) feeder.join();
    mapper.finish();
    done = true;
    querier.join();
    EXPECT_EQ(delivered, 8U);
    EXPECT_EQ(mapper.driver().newest(false)->keyframes.size(), delivered);
    expectSameMap(*mapper.snapshot(), *expected);
  }
}

}  // namespace
}  // namespace efm
