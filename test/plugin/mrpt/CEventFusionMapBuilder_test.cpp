// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/CEventFusionMapBuilder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/obs/CSensoryFrame.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <map>
#include <string>
#include <thread>

#include "test/plugin/mrpt/observations.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using mrpt::obs::CObservation;

MapCloud::ConstPtr mapOf(const std::vector<CObservation::Ptr>& observations,
                         const EventFusionOptions& options = syntheticOptions()) {
  CEventFusionMapBuilder builder(options);
  play(builder, observations);
  return builder.points();
}

TEST(CEventFusionMapBuilder, ThePoseOfTheSensorOnTheRigIsRemoved) {
  // A tracker half a metre above the rig, turned by 90 degrees: the same map.
  const SyntheticRecording recording;
  auto observations = observationsOf(recording);
  const mrpt::poses::CPose3D sensor_on_rig(0.1, -0.5, 0.2, 1.5, 0, 0);
  for (const auto& observation : observations) {
    auto pose = std::dynamic_pointer_cast<mrpt::obs::CObservationRobotPose>(observation);
    if (!pose) continue;
    pose->sensorPose = sensor_on_rig;
    pose->pose.mean = pose->pose.mean + sensor_on_rig;
  }

  const auto expected = mapOf(observationsOf(recording));
  const auto points = mapOf(observations);

  expectNear(points, expected, 1e-6);
}

TEST(CEventFusionMapBuilder, ReturnsMrptsMaps) {
  CEventFusionMapBuilder builder(syntheticOptions());
  const SyntheticRecording recording;
  play(builder, observationsOf(recording));

  const auto* metric = builder.getCurrentlyBuiltMetricMap();
  const auto event_map = metric->mapByClass<CEventFusionMap>();
  ASSERT_TRUE(event_map);
  expectSameBits(event_map->cloud().points(), builder.points());
  const auto map = metric->mapByClass<mrpt::maps::CPointsMapXYZI>();
  ASSERT_TRUE(map);
  const auto points = builder.points();
  ASSERT_EQ(map->size(), points->size());
  float x = 0;
  float y = 0;
  float z = 0;
  map->getPoint(3, x, y, z);
  EXPECT_EQ(z, points->at(3).z);
  EXPECT_EQ(map->getPointIntensity(3), points->at(3).intensity);

  mrpt::maps::CSimpleMap simple;
  builder.getCurrentlyBuiltMap(simple);
  EXPECT_EQ(simple.size(), builder.getCurrentlyBuiltMapSize());

  mrpt::poses::CPose3D pose;
  builder.getCurrentPoseEstimation()->getMean(pose);
  EXPECT_NEAR(pose.x(), recording.poses.back().T_world_rig.translation.x(), 1e-12);
}

TEST(CEventFusionMapBuilder, RefusesWhatItCannotUse) {
  CEventFusionMapBuilder builder(syntheticOptions());
  EXPECT_THROW(builder.processObservation(nullptr), std::invalid_argument);
  EXPECT_EQ(builder.ignoredObservations(), 0U);
  builder.processObservation(mrpt::obs::CObservationComment::Create());
  EXPECT_EQ(builder.ignoredObservations(), 1U);
  EventFusionOptions wrong = syntheticOptions();
  wrong.live.max_queue_mb = 0;
  EXPECT_THROW(builder.setOptions(wrong), std::invalid_argument);
  EXPECT_EQ(builder.ignoredObservations(), 1U) << "it does not start over";
  const auto* metric = builder.getCurrentlyBuiltMetricMap();
  ASSERT_EQ(metric->maps.size(), 2U);
  EXPECT_TRUE(metric->isEmpty());
}

TEST(CEventFusionMapBuilder, StartsOver) {
  const auto observations = observationsOf(SyntheticRecording());
  CEventFusionMapBuilder builder(syntheticOptions());
  builder.processObservation(mrpt::obs::CObservationComment::Create());
  play(builder, observations);
  const auto first = builder.points();
  EXPECT_THROW(builder.processObservation(observations[0]), std::logic_error) << "after its end";

  builder.initialize();
  EXPECT_TRUE(builder.points()->empty());
  EXPECT_EQ(builder.ignoredObservations(), 0U);
  EXPECT_EQ(builder.getCurrentPoseEstimation()->getMeanVal().x(), 0);
  play(builder, observations);

  expectSameBits(builder.points(), first);
}

// --- Failures of mapping -----------------------------------------------------------------------

/// Takes the planes of a number of keyframes, then fails.
class FullDisk : public DsiSink {
 public:
  explicit FullDisk(int keyframes)
      : planes_(keyframes * syntheticOptions().mapper.keyframe.planes.num_planes) {}
  void addPlane(int /*plane*/, const float* /*values*/) override {
    if (planes_-- <= 0) throw std::runtime_error("the disk is full");
  }

 private:
  std::atomic<int> planes_;
};

TEST(CEventFusionMapBuilder, KeyframesBeforeAFailureStayAndAreDelivered) {
  FullDisk disk(2);
  CEventFusionMapBuilder builder(syntheticOptions());
  builder.setDsiSink(&disk);
  std::size_t delivered = 0;
  builder.setKeyframeCallback([&](const KeyframeDepthMap&) { ++delivered; });
  feed(builder, observationsOf(SyntheticRecording()));

  EXPECT_THROW(builder.finish(), std::runtime_error);

  EXPECT_EQ(delivered, 2U);
  EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), 2U) << "a query after the error";
  EXPECT_EQ(builder.status().counts.keyframes, 2U);
  const auto event_map = builder.getCurrentlyBuiltMetricMap()->mapByClass<CEventFusionMap>();
  expectSameBits(event_map->cloud().points(), builder.points());
  EXPECT_EQ(delivered, 2U);
}

TEST(CEventFusionMapBuilder, OfARefusalAndAFailureTheRefusalIsThrown) {
  const SyntheticRecording recording(1.2);
  FullDisk disk(0);
  CEventFusionMapBuilder builder(syntheticOptions());
  builder.setDsiSink(&disk);
  std::size_t failures = 0;
  for (const auto& observation : observationsOf(recording)) {
    try {
      builder.processObservation(observation);
    } catch (const std::runtime_error&) {
      ++failures;
    }
  }
  EXPECT_GT(failures, 0U);
  auto outside = packetObservation(recording, 0);
  const std::int64_t t_ns = recording.poses.back().t_ns + 1;
  outside->timestamp = mrptTimeFrom(t_ns);
  outside->events = {{t_ns, 120, 0, true}};
  EXPECT_THROW(builder.processObservation(outside), std::invalid_argument);

  builder.setDsiSink(nullptr);
  builder.finish();
  expectSameBits(builder.points(), mapOf(observationsOf(recording)));
}

TEST(CEventFusionMapBuilder, EachKeyframeIsDeliveredBeforeTheNextIsMade) {
  // Poses come last: all keyframes become due at once.
  std::vector<CObservation::Ptr> poses;
  CEventFusionMapBuilder builder(syntheticOptions());
  std::size_t delivered = 0;
  std::int64_t newest_ns = 0;
  builder.setKeyframeCallback([&](const KeyframeDepthMap& keyframe) {
    ++delivered;
    EXPECT_GT(keyframe.window.t_ref_ns, newest_ns);
    newest_ns = keyframe.window.t_ref_ns;
    EXPECT_EQ(builder.status().counts.keyframes, delivered);
    EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), delivered) << "the map up to this keyframe";
    throw std::runtime_error("no room " + std::to_string(delivered));
  });
  const auto observations = observationsOf(SyntheticRecording());
  for (const auto& observation : observations) {
    if (IS_CLASS(*observation, mrpt::obs::CObservationRobotPose)) {
      poses.push_back(observation);
    } else {
      builder.processObservation(observation);
    }
  }
  feed(builder, poses);
  EXPECT_EQ(delivered, 0U);
  EXPECT_EQ(messageOf([&] { builder.finish(); }), "no room 1") << "the first error, at the end";
  EXPECT_EQ(delivered, 3U);
  expectSameBits(builder.points(), mapOf(observations));
}

// --- Threads -----------------------------------------------------------------------------------

TEST(CEventFusionMapBuilder, ACallbackOfTheLogMayQueryTheBuilder) {
  SyntheticRecording recording;
  recording.events[1].resize(1);
  CEventFusionMapBuilder builder(syntheticOptions());
  builder.logging_enable_console_output = false;
  std::size_t warnings = 0;
  builder.logRegisterCallback([&](std::string_view message, auto&&...) {
    ++warnings;
    EXPECT_THAT(std::string(message), testing::HasSubstr("camera 1 had no event"));
    // The first keyframe saw the one event. Another thread may ask, too, while this one waits.
    EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), 2U);
    const auto ask = [&] { return builder.status().counts.keyframes; };
    EXPECT_EQ(std::async(std::launch::async, ask).get(), 2U);
  });
  play(builder, observationsOf(recording));
  EXPECT_EQ(warnings, 1U);
}

/// Asks the builder from other threads while the sweep runs, which holds the lock.
class QueryingSink : public DsiSink {
 public:
  using Queries = std::map<std::string, std::function<void()>>;
  explicit QueryingSink(Queries questions) : queries_(std::move(questions)) {}

  void addPlane(int /*plane*/, const float* /*values*/) override {
    if (asked_.exchange(true)) return;
    std::map<std::string, std::future<void>> answers;
    for (const auto& [name, ask] : queries_) {
      answers[name] = std::async(std::launch::async, ask);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(150));
    for (auto& [name, answer] : answers) {
      if (answer.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
        answered_in_between.push_back(name);
      }
    }
    answers_ = std::move(answers);  // wait for the end of the sweep
  }

  std::vector<std::string> answered_in_between;

 private:
  Queries queries_;
  std::atomic<bool> asked_ = false;
  std::map<std::string, std::future<void>> answers_;
};

TEST(CEventFusionMapBuilder, NoQueryIsAnsweredWhileAKeyframeIsMade) {
  CEventFusionMapBuilder builder(syntheticOptions());
  QueryingSink sink({{"status", [&] { builder.status(); }},
                     {"points", [&] { builder.points(); }},
                     {"trajectory", [&] { builder.trajectory(); }},
                     {"trackerTrajectory", [&] { builder.trackerTrajectory(); }},
                     {"getCurrentPoseEstimation", [&] { builder.getCurrentPoseEstimation(); }},
                     {"getCurrentlyBuiltMapSize", [&] { builder.getCurrentlyBuiltMapSize(); }}});
  builder.setDsiSink(&sink);
  play(builder, observationsOf(SyntheticRecording()));
  EXPECT_THAT(sink.answered_in_between, testing::IsEmpty()) << "without the lock";
}

// --- Keyframes and their clouds ----------------------------------------------------------------

TEST(CEventFusionMapBuilder, AFrameWithoutAKeyframeIsAnError) {
  CEventFusionMapBuilder builder(syntheticOptions());
  play(builder, observationsOf(SyntheticRecording()));
  mrpt::maps::CSimpleMap map;
  builder.getCurrentlyBuiltMap(map);
  const auto [pose, frame] = map.get(1);
  EXPECT_EQ(frame->getObservationByIndex(0)->sensorLabel, "keyframe");
  map.insert(mrpt::poses::CPose3DPDFGaussian::Create(), mrpt::obs::CSensoryFrame::Create());
  EXPECT_THAT(messageOf([&] { builder.initialize(map); }),
              testing::HasSubstr("frame 3 of the simplemap"));
}

TEST(CEventFusionMapBuilder, ThereIsNoPictureBeforeTheFirstKeyframe) {
  CEventFusionMapBuilder builder(syntheticOptions());
  EXPECT_THROW(builder.saveCurrentEstimationToImage("never.png"), std::logic_error);
}

}  // namespace
}  // namespace efm
