// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <mrpt/config/CConfigFile.h>
#include <mrpt/config/CConfigFileMemory.h>
#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CObservationRobotPose.h>
#include <mrpt/obs/CSensoryFrame.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <fstream>
#include <functional>
#include <future>
#include <map>
#include <sstream>
#include <string>
#include <thread>

#include "plugin/mrpt/CEventFusionMapBuilder.h"
#include "plugin/mrpt/host_options.h"
#include "test/plugin/mrpt/observations.h"
#include "test/plugin/session/synthetic_recording.h"
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

using mrpt::config::CConfigFileMemory;
using testing::HasSubstr;

EventFusionOptions optionsOf(const std::string& text, const std::string& prefix) {
  OptionReader reader;
  readHostOptions(CConfigFileMemory(text), prefix, reader);
  return reader.options();
}

std::string errorOf(const std::string& text, const std::string& prefix) {
  return messageOf([&] { optionsOf(text, prefix); });
}

std::string listed(const EventFusionOptions& options) {
  std::string list;
  for (const NamedOption& option : listOptions(options)) {
    list += std::string(option.key) + "=" + textOf(option.value) + "\n";
  }
  return list;
}

TEST(HostOptions, OfSectionsThePrefixSaysWhichAreOurs) {
  struct Row {
    const char* prefix;
    const char* text;  // 9 is ours
  };
  const Row rows[] = {
      {"front", "[dsi]\nmax_depth_m = x\n[camera]\nfps = x\n[front_dsi]\nmax_depth_m = 9 ; m\n"},
      {"front", "[front_dsi]\nmax_depth_m = 9 // m\n[afront_dsi]\nmax_depth_m = x\n"},
      {"", "[camera]\nfps = x\n[dsi]\nmax_depth_m = 9\n[front_dsi]\nmax_depth_m = 8\n"},
      {"", "[map]\nfile = x\n[dsi]\nmax_depth_m = 8\n[event_fusion_dsi]\nmax_depth_m = 9\n"},
  };
  for (const Row& row : rows) {
    EXPECT_EQ(optionsOf(row.text, row.prefix).mapper.keyframe.planes.max_depth_m, 9) << row.text;
  }
  const EventFusionOptions options =
      optionsOf("[front_refinement]\nenabled = true\ntracker_noise_deg = 90\n", "front");
  EXPECT_TRUE(options.refinement.enabled);
  EXPECT_DOUBLE_EQ(options.refinement.refiner.tracker.noise_rad, M_PI / 2);
}

TEST(HostOptions, WrongSectionsKeysAndValuesAreErrorsThatNameThem) {
  EXPECT_EQ(errorOf("[a_dsi]\nnum_planes = ten\n", "a"),
            "options, section a_dsi: num_planes = ten: must be a whole number, or auto");
  EXPECT_THAT(
      errorOf("[a_dsi]\nplanes = 10\n", "a"),
      HasSubstr("options, section a_dsi: planes: unknown key: expected one of min_depth_m"));
  EXPECT_THAT(errorOf("[a_dsi]\nnum_planes = -3\n", "a"),
              HasSubstr("options, section a_dsi: num_planes = -3: must be"));
  EXPECT_THAT(errorOf("[a_dsi]\nnum_planes = 10\n[a_bsi]\nx = 1\n", "a"),
              HasSubstr("options, section a_bsi: unknown section: did you mean [dsi]?"));
  EXPECT_EQ(errorOf("[dsi]\nnum_planes = 10\n", "a"),
            "options: no section begins with a_: expected sections such as [a_dsi]");
  EXPECT_THAT(errorOf("[a_refinement]\nwindow = 0\n", "a"),
              HasSubstr("section a_refinement: window = 0: must be from 1 to 1000"));
  EXPECT_THAT(errorOf("[map]\nfile = x\n[event_fusion_map]\nvoxel = 1\n", ""),
              HasSubstr("section event_fusion_map: voxel"));
}

class HostOptionsFile : public TemporaryFolder {};

TEST_F(HostOptionsFile, IsNamedInErrorsAndPathsAreRelativeToIt) {
  CEventFusionMapBuilder builder;
  const auto error_of = [&](const std::string& file) {
    return messageOf([&] { builder.loadFromConfigFileName(file, "a"); });
  };
  const std::string wrong = (folder() / "wrong.ini").string();
  std::ofstream(wrong) << "[a_dsi]\nnum_planes = ten\n";
  EXPECT_EQ(error_of(wrong),
            wrong + ", section a_dsi: num_planes = ten: must be a whole number, or auto");
  const std::string none = (folder() / "none.ini").string();
  EXPECT_EQ(error_of(none), "cannot read the option file " + none);

  const std::string file = (folder() / "host.ini").string();
  std::ofstream(file) << "[a_rig]\ncalibration = rig/cams.yaml\n";
  OptionReader reader;
  readHostOptions(mrpt::config::CConfigFile(file), "a", reader);
  EXPECT_EQ(reader.options().rig.calibration, folder() / "rig" / "cams.yaml");
  EXPECT_EQ(optionsOf("[rig]\ncalibration = cams.yaml\n", "").rig.calibration, "cams.yaml");
}

TEST(HostOptions, ABuilderKeepsItsOptionsForMissingAndWrongKeys) {
  CEventFusionMapBuilder builder(syntheticOptions());
  builder.loadFromConfigFile(CConfigFileMemory(std::string("[a_map]\nvoxel_size_m = 0.5\n")), "a");
  EventFusionOptions expected = syntheticOptions();
  expected.cloud.voxel_size_m = 0.5;
  EXPECT_EQ(listed(builder.usedOptions()), listed(expected));

  EXPECT_THROW(builder.loadFromConfigFile(
                   CConfigFileMemory(std::string("[a_map]\nvoxel_size_m = 0\n")), "a"),
               std::invalid_argument);
  EXPECT_EQ(listed(builder.usedOptions()), listed(expected));
}

TEST(HostOptions, SavedOptionsOfABuilderReadBackTheSame) {
  for (const std::string prefix : {"", "front"}) {
    CConfigFileMemory file;
    CEventFusionMapBuilder(syntheticOptions()).saveToConfigFile(file, prefix);
    CEventFusionMapBuilder builder;
    builder.loadFromConfigFile(file, prefix);
    EXPECT_EQ(listed(builder.usedOptions()), listed(syntheticOptions()));
  }
}

TEST(HostOptions, ABuilderDumpsAllOptions) {
  std::ostringstream text;
  CEventFusionMapBuilder(syntheticOptions()).dumpToTextStream(text);
  for (const NamedOption& option : listOptions(syntheticOptions())) {
    EXPECT_THAT(text.str(), HasSubstr(std::string(option.key)));
  }
  EXPECT_THAT(text.str(), testing::ContainsRegex("threshold_c *= *60"));
}

}  // namespace

}  // namespace efm
