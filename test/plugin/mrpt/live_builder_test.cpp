// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <future>
#include <new>
#include <set>

#include "test/plugin/mrpt/live_driver.h"
#include "test/plugin/session/failing_allocation.h"
#include "test/plugin/temporary_folder.h"

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

TEST(LiveBuilder, ABudgetInSensorTimeGivesTheSameMapAtAnyPace) {
  const Observations observations = observationsOf(SyntheticRecording());
  EventFusionOptions options = liveOptions();
  options.live.max_event_rate = 1000;  // of some 4000
  std::vector<MapCloud::ConstPtr> maps;
  for (const bool patient : {true, false}) {
    CEventFusionMapBuilder builder(options);
    if (patient) {
      playPatiently(builder, observations);
    } else {
      play(builder, observations);
    }
    const SessionStatus status = builder.status();
    expectSumsAgree(status);
    EXPECT_GT(status.live->dropRatio(), 0.3);
    EXPECT_EQ(status.live->cameras.at(0).dropped, 0U);
    maps.push_back(builder.points());
  }
  ASSERT_GT(maps[0]->size(), 0U);
  expectSameBits(maps[0], maps[1]);
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

TEST(LiveBuilder, EventsWaitForPosesOnlySoLong) {
  const SyntheticRecording recording(3);
  Observations observations = observationsOf(recording);
  // The tracker is lost from 0.5 s to 2.2 s.
  const auto is_lost = [&](const CObservation::Ptr& observation) {
    const double t_s = 1e-9 * static_cast<double>(nanosecondsFrom(observation->timestamp) -
                                                  SyntheticRecording::kStartNs);
    return observation->sensorLabel == "pose" && t_s > 0.5 && t_s < 2.2;
  };
  observations.erase(std::remove_if(observations.begin(), observations.end(), is_lost),
                     observations.end());
  EventFusionOptions options = liveOptions();
  options.live.max_pose_wait_s = 0.5;
  CEventFusionMapBuilder builder(options);
  playPatiently(builder, observations);

  const SessionStatus status = builder.status();
  expectSumsAgree(status);
  EXPECT_GT(status.counts.total().without_pose, status.counts.total().read / 4);
  EXPECT_GT(*keyframeTimes(builder).rbegin(), recording.poses.back().t_ns - 300'000'000);
  EXPECT_EQ(status.live->pose_jumps, 0U) << "the rig went on at its speed";
}

class LiveBuilderWithFiles : public TemporaryFolder {};

TEST_F(LiveBuilderWithFiles, ADeclaredRigWaitsForNoCamera) {
  const std::string camera =
      "  camera_model: pinhole\n  intrinsics: [100, 100, 59.5, 44.5]\n"
      "  distortion_model: none\n  distortion_coeffs: []\n  resolution: [120, 90]\n";
  std::ofstream(folder() / "rig.yaml")
      << "cam0:\n"
      << camera << "cam1:\n"
      << camera << "  T_cn_cnm1: [[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n";
  EventFusionOptions options = liveOptions();
  options.rig.calibration = folder() / "rig.yaml";
  // Camera 1 begins at 1.6 s: undeclared, it would be an error from 1 s on.
  Observations observations = observationsOf(SyntheticRecording(3));
  const auto is_missing = [](const CObservation::Ptr& observation) {
    const auto packet = std::dynamic_pointer_cast<CObservationEvents>(observation);
    return packet && packet->camera_index == 1 &&
           nanosecondsFrom(packet->timestamp) < SyntheticRecording::kStartNs + 1'600'000'000;
  };
  observations.erase(std::remove_if(observations.begin(), observations.end(), is_missing),
                     observations.end());
  CEventFusionMapBuilder builder(options);
  const auto early = static_cast<std::ptrdiff_t>(observations.size() * 45 / 100);  // 1.5 s
  feedPatiently(builder, {observations.begin(), observations.begin() + early});
  EXPECT_EQ(builder.status().rig.cameras.size(), 2U);
  playPatiently(builder, {observations.begin() + early, observations.end()});

  const SessionStatus status = builder.status();
  expectSumsAgree(status);
  EXPECT_EQ(status.live->errors, 0U) << status.live->last_error;
  EXPECT_GT(status.counts.cameras.at(1).used, 0U);
  EXPECT_GT(status.silent_keyframes.at(1), 5U) << "counted";
  EXPECT_LT(status.silent_keyframes.at(1), 18U);
  EXPECT_GT(builder.trajectory().size(), 24U);
}

TEST(LiveBuilder, AJumpOfTheTrackerBeginsANewStretch) {
  const SyntheticRecording recording(2);
  const std::int64_t jump_ns = SyntheticRecording::kStartNs + 1'050'000'000;
  const auto move = [&](CObservation& observation) {
    auto* pose = dynamic_cast<mrpt::obs::CObservationRobotPose*>(&observation);
    if (pose && nanosecondsFrom(pose->timestamp) >= jump_ns) {
      pose->pose.mean.x_incr(10);
    }
  };
  const Observations observations = changed(observationsOf(recording), move);
  CEventFusionMapBuilder playback(syntheticOptions());
  play(playback, observationsOf(recording));
  const auto all = keyframeTimes(playback);
  for (const bool refines : {false, true}) {
    EventFusionOptions options = liveOptions();
    options.refinement.enabled = refines;
    CEventFusionMapBuilder builder(options);
    if (refines) {
      playPatiently(builder, observations);
    } else {
      play(builder, observations);  // the jump waits when the end comes
    }

    const SessionStatus status = builder.status();
    EXPECT_EQ(status.live->pose_jumps, 1U);
    expectSumsAgree(status);
    const auto times = keyframeTimes(builder);
    for (const std::int64_t t_ns : all) {  // windows of 0.2 s around t_ns
      const bool spans = t_ns - 100'000'000 < jump_ns && t_ns + 100'000'000 > jump_ns - 10'000'000;
      EXPECT_EQ(times.count(t_ns), spans ? 0U : 1U) << t_ns;
    }
    for (const StampedPose& keyframe : builder.trajectory()) {
      // The rig itself moves by 1.6 m.
      EXPECT_EQ(keyframe.T_world_rig.translation.x() > 5, keyframe.t_ns > jump_ns);
    }
    EXPECT_EQ(status.refinement.has_value(), refines);
    EXPECT_EQ(status.refinement.value_or(RefinementState{}).failures, 0U);
  }
  // A noise that explains it is no jump.
  const auto doubt = [&](CObservation& observation) {
    auto* pose = dynamic_cast<mrpt::obs::CObservationRobotPose*>(&observation);
    if (pose) pose->pose.cov.setDiagonal(6, 9);
  };
  CEventFusionMapBuilder doubtful(liveOptions());
  playPatiently(doubtful, changed(observations, doubt));
  EXPECT_EQ(doubtful.status().live->pose_jumps, 0U);
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
    const auto newest = changed({poses.back()}, [&](CObservation& pose) {
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

TEST(LiveBuilder, RefusedObservationsAreCountedAndTheMapGoesOn) {
  const SyntheticRecording recording;
  const Observations observations = observationsOf(recording);
  CEventFusionMapBuilder builder(liveOptions());
  builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
  feed(builder, {observations.begin(), observations.begin() + 75});
  EXPECT_THROW(builder.processObservation(packetOutsideTheSensor(recording)),
               std::invalid_argument);
  auto other_lens = packetObservation(recording, 1);
  other_lens->camera.fx = 99;
  other_lens->events = {{SyntheticRecording::kStartNs + 250'000'000, 1, 1, true}};
  EXPECT_THROW(builder.processObservation(other_lens), std::invalid_argument);
  auto late_pose = changed({observations[2]},
                           [](CObservation& pose) { pose.timestamp -= std::chrono::seconds(9); });
  builder.processObservation(late_pose[0]);
  playPatiently(builder, {observations.begin() + 75, observations.end()});

  const SessionStatus status = builder.status();
  EXPECT_EQ(status.live->cameras.at(0).refused, 1U);
  EXPECT_EQ(status.live->cameras.at(1).refused, 1U);
  EXPECT_EQ(status.live->refused_poses, 1U);
  EXPECT_THAT(status.live->last_error, HasSubstr("1.0"));
  EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), 3U);
  expectSumsAgree(status);
}

TEST(LiveBuilder, IsDestroyedWhileACallbackUsesIt) {
  const Observations observations = observationsOf(SyntheticRecording(1.5));
  for (int i = 0; i < 3; ++i) {
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
