// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/CEventFusionMapBuilder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CObservationPointCloud.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/obs/CSensoryFrame.h>

#include <algorithm>
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

TEST(CEventFusionMapBuilder, TurnsObservationsIntoAMapOfTheWorld) {
  const auto points = mapOf(observationsOf(SyntheticRecording()));

  ASSERT_GT(points->size(), 30U);
  for (const MapPoint& point : *points) {
    EXPECT_GE(point.z, 1);
    EXPECT_LE(point.z, 5);
  }
}

TEST(CEventFusionMapBuilder, IsMadeByName) {
  const auto object = mrpt::rtti::classFactory("efm::CEventFusionMapBuilder");
  ASSERT_TRUE(object);
  EXPECT_TRUE(std::dynamic_pointer_cast<mrpt::slam::CMetricMapBuilder>(object));
}

TEST(CEventFusionMapBuilder, ThreadsOfTheSweepDoNotChangeTheMap) {
  const auto observations = observationsOf(SyntheticRecording());
  EventFusionOptions options = syntheticOptions();
  options.mapper.keyframe.sweep.threads = 1;
  const auto one = mapOf(observations, options);
  options.mapper.keyframe.sweep.threads = 2;
  expectSameBits(one, mapOf(observations, options));
}

TEST(CEventFusionMapBuilder, KeyframesAreDeliveredOnceAndInOrder) {
  CEventFusionMapBuilder builder(syntheticOptions());
  std::vector<std::int64_t> times;
  builder.setKeyframeCallback([&](const KeyframeDepthMap& keyframe) {
    times.push_back(keyframe.window.t_ref_ns);
    EXPECT_GE(builder.status().counts.keyframes, times.size())
        << "the callback may use the builder";
  });
  play(builder, observationsOf(SyntheticRecording()));

  EXPECT_EQ(times.size(), 3U);
  EXPECT_TRUE(std::is_sorted(times.begin(), times.end()));
  EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), 3U);
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

TEST(CEventFusionMapBuilder, OtherObservationsAreCountedAndIgnored) {
  CEventFusionMapBuilder builder(syntheticOptions());
  builder.processObservation(mrpt::obs::CObservationComment::Create());
  EXPECT_EQ(builder.ignoredObservations(), 1U);
}

TEST(CEventFusionMapBuilder, SensoryFramesGiveTheSameMap) {
  const auto observations = observationsOf(SyntheticRecording());
  CEventFusionMapBuilder builder(syntheticOptions());
  mrpt::obs::CActionCollection action;
  for (const auto& observation : observations) {
    mrpt::obs::CSensoryFrame frame;
    frame.insert(observation);
    builder.processActionObservation(action, frame);
  }
  builder.finish();

  expectSameBits(builder.points(), mapOf(observations));
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

TEST(CEventFusionMapBuilder, StartsOver) {
  const auto observations = observationsOf(SyntheticRecording());
  CEventFusionMapBuilder builder(syntheticOptions());
  play(builder, observations);
  const auto first = builder.points();
  EXPECT_THROW(builder.processObservation(observations[0]), std::logic_error) << "after its end";

  builder.initialize();
  EXPECT_TRUE(builder.points()->empty());
  play(builder, observations);

  expectSameBits(builder.points(), first);
}

TEST(CEventFusionMapBuilder, InvalidOptionsChangeNothing) {
  CEventFusionMapBuilder builder(syntheticOptions());
  EventFusionOptions wrong = syntheticOptions();
  wrong.cloud.voxel_size_m = -1;
  EXPECT_THROW(builder.setOptions(wrong), std::invalid_argument);
  EXPECT_THROW(CEventFusionMapBuilder{wrong}, std::invalid_argument);
}

TEST(CEventFusionMapBuilder, ARefusedObservationDoesNotChangeTheMap) {
  const SyntheticRecording recording;
  auto observations = observationsOf(recording);
  const auto whole = mapOf(observations);

  CEventFusionMapBuilder builder(syntheticOptions());
  feed(builder, observations);
  EXPECT_THROW(builder.processObservation(packetOutsideTheSensor(recording)),
               std::invalid_argument);
  builder.finish();

  expectSameBits(builder.points(), whole);
}

TEST(CEventFusionMapBuilder, ANullObservationIsAnError) {
  CEventFusionMapBuilder builder(syntheticOptions());
  EXPECT_THROW(builder.processObservation(nullptr), std::invalid_argument);
  EXPECT_EQ(builder.ignoredObservations(), 0U);
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
  EXPECT_THROW(builder.processObservation(packetOutsideTheSensor(recording)),
               std::invalid_argument);

  builder.setDsiSink(nullptr);
  builder.finish();
  expectSameBits(builder.points(), mapOf(observationsOf(recording)));
}

TEST(CEventFusionMapBuilder, ACallbackThatThrowsDoesNotStopTheMap) {
  CEventFusionMapBuilder builder(syntheticOptions());
  builder.setKeyframeCallback([](const KeyframeDepthMap&) { throw std::runtime_error("no room"); });
  feed(builder, observationsOf(SyntheticRecording()));
  EXPECT_THROW(builder.finish(), std::runtime_error);
  builder.setKeyframeCallback(nullptr);
  EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), 3U);
}

TEST(CEventFusionMapBuilder, EachKeyframeIsDeliveredBeforeTheNextIsMade) {
  // Poses come last: all keyframes become due at once.
  std::vector<CObservation::Ptr> poses;
  CEventFusionMapBuilder builder(syntheticOptions());
  std::size_t delivered = 0;
  builder.setKeyframeCallback([&](const KeyframeDepthMap&) {
    ++delivered;
    EXPECT_EQ(builder.status().counts.keyframes, delivered);
    EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), delivered) << "the map up to this keyframe";
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
  builder.finish();

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

// --- Queries without finish --------------------------------------------------------------------

/// @param first_s where each camera's events begin, from the start.
std::vector<CObservation::Ptr> withLateCameras(const std::vector<double>& first_s) {
  std::vector<CObservation::Ptr> observations = observationsOf(SyntheticRecording());
  const auto is_early = [&](const CObservation::Ptr& observation) {
    const auto packet = std::dynamic_pointer_cast<CObservationEvents>(observation);
    if (!packet) return false;
    const double first = first_s[static_cast<std::size_t>(packet->camera_index)];
    return nanosecondsFrom(packet->timestamp) <
           SyntheticRecording::kStartNs + durationFromSeconds(first);
  };
  observations.erase(std::remove_if(observations.begin(), observations.end(), is_early),
                     observations.end());
  return observations;
}

TEST(CEventFusionMapBuilder, QueriesAfterEachObservationDoNotChangeTheMap) {
  const auto of_both = mapOf(withLateCameras({0, 0}));
  for (const double camera_1_s : {0.0, 0.3}) {
    const auto observations = withLateCameras({0, camera_1_s});
    CEventFusionMapBuilder builder(syntheticOptions());
    std::size_t delivered = 0;
    builder.setKeyframeCallback([&](const KeyframeDepthMap&) { ++delivered; });
    for (const auto& observation : observations) {
      builder.processObservation(observation);
      EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), 0U) << "another camera may still come";
      builder.getCurrentlyBuiltMetricMap();
    }
    EXPECT_EQ(delivered, 0U);
    builder.finish();
    EXPECT_EQ(delivered, 3U);
    const auto points = builder.points();
    expectSameBits(points, mapOf(observations));
    EXPECT_EQ(points->size() == of_both->size(), camera_1_s == 0) << camera_1_s;
  }
}

/// A drifting odometry from the beginning, and poses that begin 0.3 s later.
std::vector<CObservation::Ptr> odometryThenPoses() {
  std::vector<CObservation::Ptr> observations;
  for (const auto& observation : observationsOf(SyntheticRecording(0.9))) {
    const auto pose = std::dynamic_pointer_cast<mrpt::obs::CObservationRobotPose>(observation);
    if (pose) {
      auto odometry = mrpt::obs::CObservationOdometry::Create();
      odometry->timestamp = pose->timestamp;
      odometry->odometry = mrpt::poses::CPose2D(1.5 * pose->pose.mean.x(), 0, 0);
      observations.push_back(odometry);
      if (nanosecondsFrom(pose->timestamp) < SyntheticRecording::kStartNs + 300'000'000) continue;
    }
    observations.push_back(observation);
  }
  return observations;
}

TEST(CEventFusionMapBuilder, AnEarlyQueryDoesNotSelectThePoseSource) {
  const auto observations = odometryThenPoses();
  CEventFusionMapBuilder builder(syntheticOptions());
  for (const auto& observation : observations) {
    builder.processObservation(observation);
    builder.getCurrentlyBuiltMapSize();
  }
  builder.finish();
  EXPECT_EQ(builder.status().pose_source->kind, PoseKind::kPose);
  expectSameBits(builder.points(), mapOf(observations));
}

TEST(CEventFusionMapBuilder, AnEarlyQueryDoesNotRefuseTheSecondOfTwoLongPackets) {
  // 200 ms of each camera, then the poses in them.
  std::vector<CObservation::Ptr> observations;
  std::vector<CObservation::Ptr> poses;
  std::vector<CObservationEvents::Ptr> packets(2);
  const SyntheticRecording recording(0.6);
  const auto flush = [&] {
    for (auto& packet : packets) observations.push_back(std::exchange(packet, nullptr));
    observations.insert(observations.end(), poses.begin(), poses.end());
    poses.clear();
  };
  for (const auto& observation : observationsOf(recording)) {
    const auto part = std::dynamic_pointer_cast<CObservationEvents>(observation);
    if (!part) {
      poses.push_back(observation);
      if (poses.size() == 20) flush();
      continue;
    }
    auto& packet = packets[static_cast<std::size_t>(part->camera_index)];
    if (!packet) packet = packetObservation(recording, part->camera_index);
    packet->covered_until_ns = part->covered_until_ns;
    packet->events.insert(packet->events.end(), part->events.begin(), part->events.end());
  }
  flush();
  ASSERT_LT(observations.size(), 80U);

  CEventFusionMapBuilder builder(syntheticOptions());
  for (const auto& observation : observations) {
    builder.processObservation(observation);
    builder.getCurrentlyBuiltMapSize();
  }
  builder.finish();
  expectSameBits(builder.points(), mapOf(observationsOf(recording)));
}

TEST(CEventFusionMapBuilder, AQueryBeforeAnyObservationReturnsAnEmptyMap) {
  const CEventFusionMapBuilder builder(syntheticOptions());
  const auto* metric = builder.getCurrentlyBuiltMetricMap();
  ASSERT_EQ(metric->maps.size(), 2U);
  EXPECT_TRUE(metric->isEmpty());
}

// --- Keyframes and their clouds ----------------------------------------------------------------

/// The map of a whole recording: its points and its simplemap.
struct StoredMap {
  explicit StoredMap(const std::vector<CObservation::Ptr>& observations,
                     const EventFusionOptions& options = syntheticOptions()) {
    CEventFusionMapBuilder builder(options);
    play(builder, observations);
    points = builder.points();
    builder.getCurrentlyBuiltMap(keyframes);
  }
  MapCloud::ConstPtr points;
  mrpt::maps::CSimpleMap keyframes;
};

TEST(CEventFusionMapBuilder, KeyframesOfTheSimplemapHaveTheirCloudsAtTheirPoses) {
  const StoredMap map(observationsOf(SyntheticRecording()));
  ASSERT_EQ(map.keyframes.size(), 3U);
  const auto [pose, frame] = map.keyframes.get(1);
  EXPECT_NEAR(pose->getMeanVal().x(), 0.8 * 0.2, 0.01) << "the middle of 0.1 to 0.3 s";
  ASSERT_EQ(frame->size(), 1U);
  const auto seen = frame->getObservationByClass<mrpt::obs::CObservationPointCloud>();
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->sensorLabel, "keyframe");
  EXPECT_NEAR(static_cast<double>(nanosecondsFrom(seen->timestamp) - SyntheticRecording::kStartNs),
              0.2e9, 0.01e9);
  EXPECT_EQ(seen->sensorPose, mrpt::poses::CPose3D());
  EXPECT_GT(seen->pointcloud->size(), 30U);
}

TEST(CEventFusionMapBuilder, AMapOfSingleCamerasIsStored) {
  EventFusionOptions options = syntheticOptions();
  options.late_fusion = true;
  const StoredMap map(observationsOf(SyntheticRecording()), options);
  CEventFusionMap read(options.cloud);
  read.loadFromSimpleMap(map.keyframes);
  const auto points = read.cloud().points();
  ASSERT_EQ(points->size(), map.points->size());
  EXPECT_NE(points->size(), StoredMap(observationsOf(SyntheticRecording())).points->size());
}

TEST(CEventFusionMapBuilder, ContinuesAnEarlierMap) {
  const StoredMap earlier(observationsOf(SyntheticRecording()));
  const auto observations = observationsOf(SyntheticRecording(0.7));
  const StoredMap later(observations);

  CEventFusionMapBuilder builder(syntheticOptions());
  builder.initialize(earlier.keyframes);
  EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), 3U);
  EXPECT_EQ(builder.points()->size(), earlier.points->size());
  play(builder, observations);

  EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), 3U + 5U);
  GlobalCloud both(syntheticOptions().cloud);
  for (const auto* map : {&earlier, &later}) {
    for (const StoredKeyframe& keyframe : keyframesOf(map->keyframes)) {
      both.insert(both.keyframes(), worldPointsOf(keyframe), keyframe.T_world_ref);
    }
  }
  const auto points = builder.points();
  const auto expected = both.points();
  expectNear(points, expected, 1e-6);
  const auto event_map = builder.getCurrentlyBuiltMetricMap()->mapByClass<CEventFusionMap>();
  expectSameBits(event_map->cloud().points(), points);
  builder.clear();
  EXPECT_TRUE(builder.points()->empty());
}

TEST(CEventFusionMapBuilder, AFrameWithoutAKeyframeIsAnError) {
  mrpt::maps::CSimpleMap map = StoredMap(observationsOf(SyntheticRecording())).keyframes;
  map.insert(mrpt::poses::CPose3DPDFGaussian::Create(), mrpt::obs::CSensoryFrame::Create());
  CEventFusionMapBuilder builder;
  try {
    builder.initialize(map);
    FAIL() << "no error";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("frame 3 of the simplemap"));
  }
}

class CEventFusionMapBuilderFile : public TemporaryFolder {};

TEST_F(CEventFusionMapBuilderFile, ThereIsNoPictureBeforeTheFirstKeyframe) {
  CEventFusionMapBuilder builder(syntheticOptions());
  const std::string file = (folder() / "never.png").string();
  EXPECT_THROW(builder.saveCurrentEstimationToImage(file), std::logic_error);
}

TEST_F(CEventFusionMapBuilderFile, SavesItsMapAndContinuesIt) {
  const std::string file = (folder() / "saved.simplemap").string();
  CEventFusionMapBuilder builder(syntheticOptions());
  builder.setMinLoggingLevel(mrpt::system::LVL_ERROR);
  feed(builder, observationsOf(SyntheticRecording()));
  builder.saveCurrentMapToFile(file);
  const auto points = builder.points();

  builder.loadCurrentMapFromFile(file);

  const auto loaded = builder.points();
  ASSERT_EQ(loaded->size(), points->size());
  for (std::size_t i = 0; i < points->size(); ++i) {
    EXPECT_LT((positionIn(*loaded, loaded->at(i)) - positionIn(*points, points->at(i))).norm(),
              1e-6);
    EXPECT_EQ(loaded->at(i).intensity, points->at(i).intensity);
  }
}

}  // namespace
}  // namespace efm
