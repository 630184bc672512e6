// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <new>
#include <set>

#include "test/memory/failing_allocation.h"
#include "test/plugin/mrpt/live_driver.h"

namespace efm {
namespace {

using mrpt::obs::CObservation;
using testing::HasSubstr;

TEST(LiveBuilder, MakesTheMapOfPlayback) {
  const Observations observations = observationsOf(SyntheticRecording());
  CEventFusionMapBuilder playback(syntheticOptions());
  play(playback, observations);
  CEventFusionMapBuilder live(liveOptions());
  playPatiently(live, observations);

  ASSERT_GT(live.points()->size(), 30U);
  expectSameBits(live.points(), playback.points());
  EXPECT_EQ(keyframeTimes(live), keyframeTimes(playback));
  EXPECT_EQ(live.getCurrentlyBuiltMapSize(), 3U);
  mrpt::maps::CSimpleMap simple_map;
  live.getCurrentlyBuiltMap(simple_map);
  EXPECT_EQ(simple_map.size(), 3U);
  const auto* metric_map = live.getCurrentlyBuiltMetricMap();
  ASSERT_EQ(metric_map->maps.size(), 1U);
  EXPECT_EQ(dynamic_cast<const mrpt::maps::CPointsMapXYZI&>(*metric_map->maps[0]).size(),
            live.points()->size());
  const SessionStatus status = live.status();
  expectSumsAgree(status);
  EXPECT_EQ(status.live->dropRatio(), 0);
  EXPECT_EQ(status.live->errors, 0U) << status.live->last_error;
}

TEST(LiveBuilder, OldKeyframesLeaveTheSimplemapAndStayInTheMap) {
  const Observations observations = observationsOf(SyntheticRecording(2));
  CEventFusionMapBuilder all(liveOptions());
  playPatiently(all, observations);
  EventFusionOptions options = liveOptions();
  options.live.max_keyframes = 4;
  CEventFusionMapBuilder builder(options);
  playPatiently(builder, observations);

  EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), 4U);
  mrpt::maps::CSimpleMap simple_map;
  builder.getCurrentlyBuiltMap(simple_map);
  const auto [pose, frame] = simple_map.get(3);
  EXPECT_NEAR(pose->getMeanVal().x(), all.trajectory().back().T_world_rig.translation.x(), 1e-12);
  EXPECT_EQ(keyframeTimes(builder), keyframeTimes(all));
  expectSameBits(builder.points(), all.points());
}

TEST(LiveBuilder, EachSnapshotHasMoreThanTheOneBefore) {
  CEventFusionMapBuilder builder(liveOptions());
  std::mutex mutex;
  std::vector<std::size_t> keyframes;
  builder.setMapCallback([&](const std::shared_ptr<const MapSnapshot>& map) {
    const std::lock_guard<std::mutex> lock(mutex);
    keyframes.push_back(map->trajectory.size());
  });
  feedPatiently(builder, observationsOf(SyntheticRecording(2)));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // some dozen times their cost
  const std::lock_guard<std::mutex> lock(mutex);
  ASSERT_GT(keyframes.size(), 1U);
  for (std::size_t i = 1; i < keyframes.size(); ++i) EXPECT_GT(keyframes[i], keyframes[i - 1]);
}

/// Stops the mapping's thread in the callback of its first keyframe.
class Stop {
 public:
  explicit Stop(CEventFusionMapBuilder& builder) {
    builder.setKeyframeCallback([this](const KeyframeDepthMap&) {
      if (!reached_.exchange(true)) go_.get_future().wait();
    });
  }
  bool isReached() const { return reached_; }
  void release() { go_.set_value(); }

 private:
  std::atomic<bool> reached_{false};
  std::promise<void> go_;
};

TEST(LiveBuilder, TheCallerNeverWaitsAndNewestInputWins) {
  const SyntheticRecording recording(2);
  const Observations observations = observationsOf(recording);
  EventFusionOptions options = liveOptions();
  options.live.max_queue_events = 2500;  // more than a window, less than the recording
  CEventFusionMapBuilder builder(options);
  Stop stop(builder);
  std::size_t i = 0;
  for (; i < observations.size() && !stop.isReached(); ++i) {
    builder.processObservation(observations[i]);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ASSERT_LT(i, observations.size());
  // All of these return while the mapping stands still.
  for (; i < observations.size(); ++i) builder.processObservation(observations[i]);
  EXPECT_GE(builder.getCurrentlyBuiltMapSize(), 1U);
  EXPECT_FALSE(builder.points()->empty());
  const auto pose = builder.getCurrentPoseEstimation();
  EXPECT_NEAR(pose->getMeanVal().x(), 1.6, 1e-9) << "the newest pose, though nothing is mapped";
  const SessionStatus before = builder.status();
  EXPECT_LE(before.live->cameras.at(0).queued + before.live->cameras.at(1).queued, 2500U);
  EXPECT_GT(before.live->cameras.at(0).dropped, 0U);
  stop.release();
  builder.finish();

  const SessionStatus after = builder.status();
  expectSumsAgree(after);
  EXPECT_GT(after.counts.windows_given_up.overload, 0U);
  EXPECT_EQ(after.counts.windows_given_up.total(), after.counts.windows_given_up.overload);
  EXPECT_GT(*keyframeTimes(builder).rbegin(), recording.poses.back().t_ns - 300'000'000)
      << "the newest window is mapped";
  // The keyframes that were made are those of playback: no window lacks a part of its events.
  CEventFusionMapBuilder playback(syntheticOptions());
  play(playback, observations);
  const auto all = keyframeTimes(playback);
  for (const std::int64_t t_ns : keyframeTimes(builder)) EXPECT_EQ(all.count(t_ns), 1U);
}

TEST(LiveBuilder, AJumpBeginsANewStretchUnlessItsNoiseExplainsIt) {
  const SyntheticRecording recording(1.2);
  const std::int64_t jump_ns = SyntheticRecording::kStartNs + 650 * kMs;
  CEventFusionMapBuilder playback(syntheticOptions());
  play(playback, observationsOf(recording));
  for (const bool is_noise : {false, true}) {
    const auto move = [&](CObservation& observation) {
      auto* pose = dynamic_cast<mrpt::obs::CObservationRobotPose*>(&observation);
      if (pose && nanosecondsFrom(pose->timestamp) >= jump_ns) pose->pose.mean.x_incr(10);
      if (pose && is_noise) pose->pose.cov.setDiagonal(6, 9);  // 3 m
    };
    EventFusionOptions options = liveOptions();
    options.refinement.enabled = !is_noise;
    CEventFusionMapBuilder builder(options);
    builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
    playPatiently(builder, changed(observationsOf(recording), move));
    EXPECT_EQ(builder.status().live->pose_jumps, is_noise ? 0U : 1U);
    if (is_noise) continue;
    const auto times = keyframeTimes(builder);
    for (const std::int64_t t_ns : keyframeTimes(playback)) {  // windows of 0.2 s around t_ns
      const bool spans = t_ns - 100 * kMs < jump_ns && t_ns + 100 * kMs > jump_ns - 10 * kMs;
      EXPECT_EQ(times.count(t_ns), spans ? 0U : 1U) << t_ns;
    }
    for (const StampedPose& keyframe : builder.trajectory()) {
      // The rig itself moves by 1 m.
      EXPECT_EQ(keyframe.T_world_rig.translation.x() > 5, keyframe.t_ns > jump_ns);
    }
    EXPECT_EQ(builder.status().refinement->failures, 0U);
    expectSumsAgree(builder.status());
  }
}

TEST(LiveBuilder, PosesWaitForEventsTenMinutes) {
  const SyntheticRecording recording;
  const Observations observations = observationsOf(recording);
  for (const double wait_s : {590, 610}) {
    CEventFusionMapBuilder builder(liveOptions());
    Observations poses;
    Observations packets;
    for (const auto& observation : observations) {
      (observation->sensorLabel == "pose" ? poses : packets).push_back(observation);
    }
    // Two: one alone would be refused.
    const auto newest = changed({poses.back(), poses.back()}, [&](CObservation& pose) {
      pose.timestamp +=
          std::chrono::duration_cast<mrpt::Clock::duration>(std::chrono::duration<double>(wait_s));
    });
    feed(builder, poses);
    feed(builder, newest);
    while (builder.status().poses.value_or(TimeSpan{}).last_ns <= recording.poses.back().t_ns) {
      std::this_thread::yield();
    }
    playPatiently(builder, packets);
    const SessionStatus status = builder.status();
    expectSumsAgree(status);
    EXPECT_EQ(status.counts.total().dropped == status.counts.total().read, wait_s > 600) << wait_s;
    EXPECT_EQ(builder.trajectory().size(), wait_s > 600 ? 0U : 3U);
  }
}

TEST(LiveBuilder, AfterAnErrorTheNextKeyframeIsTried) {
  struct FailingSink : DsiSink {
    std::atomic<int> planes{0};
    void addPlane(int /*plane*/, const float* /*values*/) override {
      if (planes++ == 40) throw std::runtime_error("disk full");
    }
  } sink;
  const Observations observations = observationsOf(SyntheticRecording());
  CEventFusionMapBuilder builder(liveOptions());
  builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
  builder.setDsiSink(&sink);
  int delivered = 0;
  builder.setKeyframeCallback([&](const KeyframeDepthMap&) {
    if (++delivered == 1) throw std::runtime_error("the host's own");
  });
  playPatiently(builder, observations);

  const SessionStatus status = builder.status();
  EXPECT_EQ(status.live->errors, 2U);
  EXPECT_FALSE(status.live->failing);
  EXPECT_THAT(status.live->last_error, HasSubstr("disk full"));
  EXPECT_EQ(delivered, 2) << "of three";
  EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), 2U);
  expectSumsAgree(status);
}

TEST(LiveBuilder, IsDestroyedWhileACallbackUsesIt) {
  const Observations observations = observationsOf(SyntheticRecording(1.5));
  {
    std::promise<void> within;
    std::atomic<bool> is_first{true};
    {
      CEventFusionMapBuilder builder(liveOptions());
      builder.setKeyframeCallback([&](const KeyframeDepthMap&) {
        if (!is_first.exchange(false)) return;
        within.set_value();
        for (int k = 0; k < 200; ++k) {
          builder.points();
          builder.status();
          std::this_thread::sleep_for(std::chrono::microseconds(100));
        }
      });
      feed(builder, observations);
      within.get_future().wait();
    }
  }
}

TEST(LiveBuilder, FinishReturnsWhereAnotherThreadStartsOver) {
  const Observations observations = observationsOf(SyntheticRecording(2));
  for (int i = 0; i < 5; ++i) {
    CEventFusionMapBuilder builder(liveOptions());
    feed(builder, observations);
    auto finished = std::async(std::launch::async, [&] { builder.finish(); });
    std::this_thread::sleep_for(std::chrono::milliseconds(10 * i));
    builder.initialize();
    ASSERT_EQ(finished.wait_for(std::chrono::seconds(60)), std::future_status::ready);
  }
}

TEST(LiveBuilder, StartsOverAndEndsWhileItMaps) {
  const Observations observations = observationsOf(SyntheticRecording(1.5));
  CEventFusionMapBuilder builder(liveOptions());
  builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
  std::atomic<int> refusals{0};
  builder.setKeyframeCallback([&](const KeyframeDepthMap&) {
    builder.status();
    EXPECT_THROW(builder.initialize(), std::logic_error) << "its own thread";
    EXPECT_THROW(builder.finish(), std::logic_error);
    ++refusals;
  });
  feed(builder, observations);
  while (refusals == 0) std::this_thread::yield();
  builder.initialize();
  EXPECT_EQ(builder.status().counts.keyframes, 0U);
  feed(builder, observations);
  builder.setOptions(syntheticOptions());  // playback
  EXPECT_FALSE(builder.status().live);
}

// --- Both modes ------------------------------------------------------------------------------

class BuilderOfBothModes : public testing::TestWithParam<bool> {
 protected:
  static EventFusionOptions options() { return GetParam() ? liveOptions() : syntheticOptions(); }
};
INSTANTIATE_TEST_SUITE_P(, BuilderOfBothModes, testing::Bool());

TEST_P(BuilderOfBothModes, MapsNothingWhileUpdatingIsDisabled) {
  const SyntheticRecording recording(3);
  const Observations observations = observationsOf(recording);
  CEventFusionMapBuilder builder(options());
  const auto half = static_cast<std::ptrdiff_t>(observations.size() / 2);
  const auto end = static_cast<std::ptrdiff_t>(observations.size() - 150);  // 0.5 s before the end
  feedPatiently(builder, {observations.begin(), observations.begin() + half});
  builder.enableMapUpdating(false);
  feedPatiently(builder, {observations.begin() + half, observations.begin() + end});
  EXPECT_NEAR(builder.getCurrentPoseEstimation()->getMeanVal().x(), 0.8 * 2.5, 0.02)
      << "the pose goes on";
  builder.enableMapUpdating(true);
  feedPatiently(builder, {observations.begin() + end, observations.end()});
  builder.finish();

  for (const std::int64_t t_ns : keyframeTimes(builder)) {
    const double t_s = 1e-9 * static_cast<double>(t_ns - SyntheticRecording::kStartNs);
    EXPECT_TRUE(t_s < 1.4 || t_s > 2.6) << t_s << " s: in the middle of a window of 0.2 s";
  }
  EXPECT_EQ(keyframeTimes(builder).size(), 13U + 3U);
  const SessionStatus status = builder.status();
  std::uint64_t paused = 0;
  for (const auto& [camera, count] : status.paused_events) paused += count;
  if (status.live) paused += status.live->cameras.at(0).paused + status.live->cameras.at(1).paused;
  EXPECT_GT(paused, 0U);
  std::uint64_t fed = 0;
  for (const auto& observation : observations) {
    const auto packet = std::dynamic_pointer_cast<CObservationEvents>(observation);
    if (packet) fed += packet->events.size();
  }
  EXPECT_EQ(paused + status.counts.total().read, fed);
}

TEST_P(BuilderOfBothModes, ThePoseHasTheTrackersCovariance) {
  const auto state = [](CObservation& observation) {
    auto* pose = dynamic_cast<mrpt::obs::CObservationRobotPose*>(&observation);
    if (!pose) return;
    pose->pose.cov.setDiagonal(6, 0.04);
    pose->pose.cov(0, 0) = 0.01;
  };
  CEventFusionMapBuilder builder(options());
  playPatiently(builder, changed(observationsOf(SyntheticRecording()), state));
  const auto pose = std::dynamic_pointer_cast<mrpt::poses::CPose3DPDFGaussian>(
      builder.getCurrentPoseEstimation());
  ASSERT_TRUE(pose);
  EXPECT_NEAR(pose->cov(0, 0), 0.01, 1e-9);
  EXPECT_NEAR(pose->cov(4, 4), 0.04, 1e-9);
}

TEST_P(BuilderOfBothModes, TellsChoicesOfOptionsAndRoundedPoints) {
  EventFusionOptions options = this->options();
  options.automatic = defaultOptions().automatic;
  for (const bool rests : {false, true}) {  // by its poses: one camera alone sees no scene then
    SyntheticRecording recording(1.5, rests ? 1 : 2);
    for (StampedPose& pose : recording.poses) {
      pose.T_world_rig.translation.x() = 5e6 + (rests ? 0 : pose.T_world_rig.translation.x());
    }
    CEventFusionMapBuilder builder(options);
    builder.logging_enable_console_output = false;
    std::vector<std::string> told;
    builder.logRegisterCallback([&](std::string_view text, auto&&...) { told.emplace_back(text); });
    playPatiently(builder, observationsOf(recording));
    for (int i = 0; i < 2; ++i) builder.getCurrentlyBuiltMetricMap();
    const auto times = [&](const std::string& begin) {
      return static_cast<std::uint64_t>(
          std::count_if(told.begin(), told.end(),
                        [&](const std::string& text) { return text.find(begin) == 0; }));
    };
    const std::uint64_t choices = builder.status().choices;
    EXPECT_GE(choices, 1U);
    EXPECT_EQ(times("options chosen from the data: "), choices);
    EXPECT_EQ(times("no-scene: "), rests ? choices : 0U);
    if (rests) continue;
    EXPECT_FALSE(builder.points()->empty());
    EXPECT_EQ(times("MRPT's maps have float points"), 1U);
  }
}

TEST_P(BuilderOfBothModes, AHostOfMrptAloneEndsItByAComment) {
  CEventFusionMapBuilder builder(options());
  feed(builder, observationsOf(SyntheticRecording(0.215)));  // its window ends with the recording
  auto comment = mrpt::obs::CObservationComment::Create();
  comment->text = "event_fusion: finish";
  builder.processObservation(comment);
  EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), 1U);
  EXPECT_EQ(builder.ignoredObservations(), 0U);
}

TEST_P(BuilderOfBothModes, AFrameWithABadObservationLosesNoOther) {
  const SyntheticRecording recording;
  CEventFusionMapBuilder builder(options());
  builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
  mrpt::obs::CActionCollection action;
  int refusals = 0;
  for (const auto& observation : observationsOf(recording)) {
    mrpt::obs::CSensoryFrame frame;
    auto bad = packetObservation(recording, 0);
    bad->timestamp = observation->timestamp;
    bad->events = {{nanosecondsFrom(observation->timestamp), 120, 0, true}};
    frame.insert(bad);
    frame.insert(observation);
    try {
      builder.processActionObservation(action, frame);
    } catch (const std::invalid_argument&) {
      ++refusals;
    }
  }
  builder.finish();
  EXPECT_GT(refusals, 100);
  EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), 3U);
}

TEST_P(BuilderOfBothModes, WhereMemoryEndsTheMapAndTheCloudsOfItsKeyframesStayEqual) {
  struct FailingSink : DsiSink {
    std::size_t skipped = std::size_t(-1);
    int keyframes = 0;
    void addPlane(int plane, const float* /*values*/) override {
      if (plane == 29 && ++keyframes == 2) failAllocation(Allocating::kThisThread, skipped);
    }
  };
  const SyntheticRecording recording;
  const Observations observations = announced(recording, observationsOf(recording));
  EventFusionOptions options = this->options();
  options.mapper.keyframe.sweep.threads = 1;  // the sink is called by the thread that maps
  const auto run = [&](std::size_t skipped) {
    FailingSink sink;
    sink.skipped = skipped;
    CEventFusionMapBuilder builder(options);
    builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
    builder.setDsiSink(&sink);
    std::vector<std::size_t> allocations;
    builder.setKeyframeCallback([&](const KeyframeDepthMap&) {
      if (sink.keyframes == 2) allocations = stopFailing();
    });
    std::size_t errors = 0;
    for (const auto& observation : observations) {
      try {
        feedPatiently(builder, {observation});
      } catch (const std::bad_alloc&) {
        ++errors;
      }
    }
    builder.finish();
    stopFailing();

    const SessionStatus status = builder.status();
    if (status.live) errors = status.live->errors;
    EXPECT_LE(errors, skipped == std::size_t(-1) ? 0U : 1U);
    mrpt::maps::CSimpleMap simple_map;
    builder.getCurrentlyBuiltMap(simple_map);
    const std::vector<StampedPose> trajectory = builder.trajectory();
    EXPECT_GE(trajectory.size(), 2U) << "of three";
    EXPECT_EQ(status.counts.keyframes, trajectory.size());
    EXPECT_EQ(simple_map.size(), trajectory.size());
    const std::vector<StoredKeyframe> keyframes = keyframesOf(simple_map);
    for (std::size_t i = 0; i < std::min(keyframes.size(), trajectory.size()); ++i) {
      EXPECT_LT(std::abs(keyframes[i].t_ref_ns - trajectory[i].t_ns), 100) << "MRPT's tick";
    }
    CEventFusionMapBuilder again(options);
    again.initialize(simple_map);
    expectSameBits(again.points(), withoutSigma(builder.points()));
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

TEST_P(BuilderOfBothModes, TheCloudsOfAnInitialMapAreCopied) {
  mrpt::maps::CSimpleMap simple_map;
  CEventFusionMapBuilder builder(options());
  playPatiently(builder, observationsOf(SyntheticRecording()));
  builder.getCurrentlyBuiltMap(simple_map);
  const std::size_t points = builder.points()->size();
  builder.initialize(simple_map);
  for (const auto& [pose, frame] : simple_map) {
    auto seen = frame->getObservationByClass<mrpt::obs::CObservationPointCloud>();
    seen->pointcloud->clear();
  }
  EXPECT_EQ(builder.points()->size(), points);
  mrpt::maps::CSimpleMap again;
  builder.getCurrentlyBuiltMap(again);
  const auto [pose, frame] = again.get(0);
  EXPECT_GT(frame->getObservationByClass<mrpt::obs::CObservationPointCloud>()->pointcloud->size(),
            0U);
}

}  // namespace
}  // namespace efm
