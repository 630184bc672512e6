// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/CEventFusionMapBuilder.h"

#include <gmock/gmock.h>
#include <mrpt/config/CConfigFile.h>
#include <mrpt/config/CConfigFileMemory.h>
#include <mrpt/maps/CPointsMapXYZI.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>
#include <unistd.h>

#include <Eigen/Eigenvalues>
#include <atomic>
#include <chrono>
#include <cmath>
#include <fstream>
#include <future>
#include <sstream>
#include <thread>

#include "plugin/mrpt/host_options.h"
#include "plugin/options/option_keys.h"
#include "plugin/session_file/session_file.h"
#include "test/plugin/mrpt/observations.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using mrpt::config::CConfigFileMemory;
using mrpt::obs::CObservation;
using mrpt::obs::CObservationPointCloud;
using testing::HasSubstr;

void feed(CEventFusionMapBuilder& builder, const std::vector<CObservation::Ptr>& observations) {
  for (const auto& observation : observations) builder.processObservation(observation);
}

void play(CEventFusionMapBuilder& builder, const std::vector<CObservation::Ptr>& observations) {
  feed(builder, observations);
  builder.finish();
}

MapSnapshot snapshotOf(const CEventFusionMapBuilder& builder) {
  return {builder.trajectory(), builder.trackerTrajectory(), {}, builder.points()};
}

mrpt::poses::CPose3DPDFGaussian estimateOf(const CEventFusionMapBuilder& builder) {
  return dynamic_cast<const mrpt::poses::CPose3DPDFGaussian&>(*builder.getCurrentPoseEstimation());
}

/// Returns samples with random poses. Their noise alternates between keyframes.
Samples noisySamples() {
  Samples samples = samplesOf(shaken(SyntheticRecording(1.3)));
  for (Sample& sample : samples) {
    auto* const pose = std::get_if<PoseSample>(&sample);
    if (pose == nullptr) continue;
    const bool is_certain = (pose->t_ns - SyntheticRecording::kStartNs) / kShakenWindowNs % 2 == 0;
    pose->noise = is_certain ? PoseNoise{0x1p-13, 0x1p-16} : PoseNoise{0x1p-4, 0x1p-6};
  }
  return samples;
}

/// Expects that MRPT's maps contain the builder's map.
void expectGettersAgree(CEventFusionMapBuilder& builder) {
  const MapCloud::ConstPtr points = builder.points();
  const std::vector<StampedPose> trajectory = builder.trajectory();
  EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), trajectory.size());
  mrpt::maps::CSimpleMap simple;
  builder.getCurrentlyBuiltMap(simple);
  ASSERT_EQ(simple.size(), trajectory.size());
  GlobalCloud cloud(builder.usedOptions().cloud);
  std::size_t number = 0;
  for (const StoredKeyframe& keyframe : keyframesOf(simple)) {
    const Rigid3& T_world_ref = trajectory[number].T_world_rig;
    EXPECT_LT(std::abs(keyframe.t_ref_ns - trajectory[number].t_ns), kTickNs);
    EXPECT_EQ(keyframe.T_world_ref.translation, T_world_ref.translation);
    EXPECT_LT(keyframe.T_world_ref.rotation.angularDistance(T_world_ref.rotation), 1e-14);
    // The simplemap's angles may round, so the cloud is compared at the exact pose.
    cloud.insert(number++, pointsInWorld(*keyframe.points, T_world_ref), T_world_ref);
  }
  auto expected = pcl::make_shared<MapCloud>(*points);
  for (MapPoint& point : *expected) {  // a simplemap cannot store them
    point.sigma = MapPoint().sigma;
    point.probability = MapPoint().probability;
  }
  expectSameBits(cloud.points(), expected);

  const auto* const metric = builder.getCurrentlyBuiltMetricMap();
  const auto event_map = metric->mapByClass<CEventFusionMap>();
  EXPECT_EQ(event_map == nullptr, builder.usedOptions().live.enabled);
  if (event_map) expectSameBits(event_map->cloud().points(), points);
  const auto map = metric->mapByClass<mrpt::maps::CPointsMapXYZI>();
  ASSERT_TRUE(map);
  ASSERT_EQ(map->size(), points->size());
  for (std::size_t i = 0; i < points->size(); i += 7) {
    mrpt::math::TPoint3Df point;
    map->getPoint(i, point.x, point.y, point.z);
    EXPECT_EQ(point.z, points->at(i).z);
    EXPECT_EQ(map->getPointIntensity(i), points->at(i).intensity);
  }
}

class BuilderInEitherMode : public testing::TestWithParam<bool> {
 protected:
  static EventFusionOptions in(EventFusionOptions options = syntheticOptions()) {
    options.live.enabled = GetParam();
    return options;
  }
};
INSTANTIATE_TEST_SUITE_P(Live, BuilderInEitherMode, testing::Bool());

TEST_P(BuilderInEitherMode, GivesTheMapOfTheMapperWhileAThreadAsks) {
  Samples samples = noisySamples();
  const auto observations = observationsOf(samples);
  for (std::size_t i = 0; i < samples.size(); ++i) {  // MRPT's classes round the poses
    if (const auto pose = poseIn(*observations[i])) samples[i] = *pose;
  }
  for (const bool is_refined : {false, true}) {
    EventFusionOptions options = in(refinedOptions());
    options.refinement.enabled = is_refined;
    options.refinement.refiner.adapt_tracker = false;
    EventFusionOptions with_session = options;
    with_session.session_file = testing::TempDir() + "builder" + std::to_string(getpid()) + ".mcap";
    CEventFusionMapBuilder builder(with_session);
    play(builder, observations);
    mrpt::maps::CSimpleMap initial;
    builder.getCurrentlyBuiltMap(initial);
    MapperOfRig mapper(options, {}, keyframesOf(initial));
    play(mapper, samples);

    builder.initialize(initial);
    for (const auto& [pose, frame] : initial) {  // clearing must not change the builder's copies
      frame->getObservationByClass<CObservationPointCloud>()->pointcloud->clear();
    }
    EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), 12U);
    std::atomic<bool> done = false;
    std::thread querier([&] {
      while (!done) {
        mrpt::maps::CSimpleMap simple;
        builder.getCurrentlyBuiltMap(simple);
        EXPECT_EQ(keyframesOf(simple).size(), simple.size());
        builder.getCurrentlyBuiltMetricMap();
        estimateOf(builder);
      }
    });
    play(builder, observations);
    done = true;
    querier.join();
    expectSameMap(snapshotOf(builder), *mapper.snapshot());
    EXPECT_EQ(builder.trajectory().size(), 24U);
    const SessionFile session(with_session.session_file);
    const std::vector<StampedPose> stored = session.poses(true);
    ASSERT_EQ(stored.size(), 12U) << "without the initial map";
    for (std::size_t i = 0; i < stored.size(); ++i) {
      EXPECT_TRUE(isSame(stored[i].T_world_rig, builder.trajectory()[12 + i].T_world_rig)) << i;
    }
    EXPECT_THAT(session.report(), HasSubstr(mapHash(*builder.points())));
    for (const char* number : {"", ".1", ".2", ".3", ".4"}) {
      std::filesystem::remove(with_session.session_file.string() + number);
    }
    expectGettersAgree(builder);
    if (is_refined) continue;
    const PoseSample& newest = std::get<PoseSample>(samples.back());
    const Rigid3 T_world_rig = rigidFrom(estimateOf(builder).mean);
    EXPECT_LT((T_world_rig.translation - newest.T_world_body.translation).norm(), 1e-12);
    EXPECT_LT(T_world_rig.rotation.angularDistance(newest.T_world_body.rotation), 1e-12);
    for (int i = 0; i < 6; ++i) {
      EXPECT_EQ(estimateOf(builder).cov(i, i),
                std::pow(i < 3 ? newest.noise->noise_m : newest.noise->noise_rad, 2));
    }
  }
}

TEST(CEventFusionMapBuilder, RefinedKeyframesMoveInMrptsMapsAndCorrectThePose) {
  const Samples samples = noisySamples();
  CEventFusionMapBuilder builder(refinedOptions());
  EXPECT_TRUE(isSame(rigidFrom(estimateOf(builder).mean), Rigid3{}));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    feed(builder, observationsOf({samples[i]}));
    if (i % 23 == 7) expectGettersAgree(builder);
    const auto* const pose = std::get_if<PoseSample>(&samples[i]);
    if (pose == nullptr) continue;
    const Rigid3 T_world_rig =
        builder.status().refinement.value().T_world_odom * pose->T_world_body;
    const auto estimate = estimateOf(builder);
    EXPECT_LT((rigidFrom(estimate.mean).translation - T_world_rig.translation).norm(), 1e-9);
    EXPECT_LT(rigidFrom(estimate.mean).rotation.angularDistance(T_world_rig.rotation), 1e-9);
    if (builder.trajectory().size() < 2) continue;
    const Matrix6d covariance = estimate.cov.asEigen();
    EXPECT_LT((covariance - covariance.transpose()).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(covariance).eigenvalues()(0), 0);
    EXPECT_LT(covariance.diagonal().maxCoeff(), 0.01);
  }
  EXPECT_GT(builder.status().refinement->T_world_odom.translation.norm(), 1e-4);
}

TEST(CEventFusionMapBuilder, RejectsWhatItCannotUseAndDoesNotStartOver) {
  CEventFusionMapBuilder builder(syntheticOptions());
  EXPECT_THROW(builder.processObservation(nullptr), std::invalid_argument);
  EXPECT_EQ(builder.ignoredObservations(), 0U);
  builder.processObservation(mrpt::obs::CObservationComment::Create());
  EXPECT_THROW(builder.saveCurrentEstimationToImage("never.png"), std::logic_error)
      << "before the first keyframe";
  EventFusionOptions wrong = syntheticOptions();
  wrong.live.max_queue_mb = 0;
  EXPECT_THROW(builder.setOptions(wrong), std::invalid_argument);
  EXPECT_EQ(builder.getCurrentlyBuiltMetricMap()->maps.size(), 2U);
  EXPECT_TRUE(builder.getCurrentlyBuiltMetricMap()->isEmpty());

  play(builder, observationsOf(SyntheticRecording()));
  mrpt::maps::CSimpleMap map;
  builder.getCurrentlyBuiltMap(map);
  const auto [pose, frame] = map.get(1);
  EXPECT_EQ(frame->getObservationByIndex(0)->sensorLabel, "keyframe");
  map.insert(mrpt::poses::CPose3DPDFGaussian::Create(), mrpt::obs::CSensoryFrame::Create());
  EXPECT_THAT(messageOf([&] { builder.initialize(map); }), HasSubstr("frame 3 of the simplemap"));
  EXPECT_EQ(builder.ignoredObservations(), 1U);
  EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), 3U);
}

// --- Start over --------------------------------------------------------------------------------

TEST_P(BuilderInEitherMode, StartsOverAtAnyTimeWithTheSameCallbacksAndSink) {
  struct CountingSink : DsiSink {
    std::atomic<int> planes{0};
    void addPlane(int /*plane*/, const float* /*values*/) override { ++planes; }
  } sink;
  const Samples samples = samplesOf(SyntheticRecording(1.3));
  const auto observations = observationsOf(samples);
  CEventFusionMapBuilder builder(in(refinedOptions()));  // the keyframes wait for the refinement
  builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
  builder.setDsiSink(&sink);
  std::atomic<int> keyframes{0};
  std::atomic<int> maps{0};
  builder.setMapCallback([&](const auto&) { ++maps; });
  builder.setKeyframeCallback([&](const KeyframeDepthMap&) {
    ++keyframes;
    if (!GetParam()) return;
    EXPECT_THROW(builder.initialize(), std::logic_error) << "its own thread";
  });
  builder.processObservation(mrpt::obs::CObservationComment::Create());
  feed(builder, observations);
  while (keyframes == 0) std::this_thread::yield();
  auto finished = std::async(std::launch::async, [&] { builder.finish(); });
  builder.initialize();
  ASSERT_EQ(finished.wait_for(std::chrono::seconds(60)), std::future_status::ready);
  EXPECT_EQ(builder.ignoredObservations(), 0U);
  builder.initialize();  // the other thread may have finished the new map already
  feed(builder, observations);
  builder.setOptions(in());
  EXPECT_TRUE(builder.points()->empty());
  EXPECT_EQ(estimateOf(builder).mean.x(), 0);
  EXPECT_EQ(builder.status().counts.keyframes, 0U);

  keyframes = maps = sink.planes = 0;
  play(builder, observations);
  EXPECT_EQ(keyframes, 11);
  EXPECT_EQ(sink.planes, 11 * 30);
  EXPECT_EQ(maps > 0, GetParam());
  expectSameMap(snapshotOf(builder), *mapOf(syntheticOptions(), samples));
}

TEST(CEventFusionMapBuilder, AHostMayDropItsLastReferenceInACallback) {
  auto builder = std::make_shared<CEventFusionMapBuilder>(live());
  std::promise<void> fed;
  std::promise<void> dropped;
  builder->setKeyframeCallback([&](const KeyframeDepthMap&) {
    fed.get_future().wait();
    builder.reset();
    dropped.set_value();
  });
  auto is_dropped = dropped.get_future();
  for (const auto& observation : declaredObservationsOf(samplesOf(SyntheticRecording()))) {
    builder->processObservation(observation);
  }
  EXPECT_NEAR(estimateOf(*builder).mean.x(), 0.4, 1e-9) << "the pose does not wait";
  fed.set_value();
  is_dropped.wait();
  EXPECT_EQ(builder, nullptr);
}

// --- Hosts that use MRPT only ------------------------------------------------------------------

TEST_P(BuilderInEitherMode, WhileUpdatingIsDisabledPacketsAreSkippedAndThePoseGoesOn) {
  const SyntheticRecording recording(0.4);
  CEventFusionMapBuilder builder(in());
  builder.enableMapUpdating(false);
  play(builder, observationsOf(recording));
  const SessionStatus status = builder.status();
  std::uint64_t paused = 0;
  for (const auto& [camera, count] : status.paused_events) paused += count;
  if (GetParam())
    paused = status.live->cameras.at(0).fates[QueueFate::kPaused] +
             status.live->cameras.at(1).fates[QueueFate::kPaused];
  EXPECT_GT(paused, 100U);
  EXPECT_EQ(status.counts.total().read, 0U);
  EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), 0U);
  EXPECT_NEAR(estimateOf(builder).mean.x(), 0.8 * 0.4, 1e-9);
}

TEST_P(BuilderInEitherMode, ABadObservationInAFrameTakesNoOtherWithIt) {
  const SyntheticRecording recording;
  CEventFusionMapBuilder builder(in());
  builder.setVerbosityLevel(mrpt::system::LVL_ERROR);
  mrpt::obs::CActionCollection action;
  int errors = 0;
  for (const auto& observation : observationsOf(recording)) {
    const std::int64_t t_ns = nanosecondsFrom(observation->timestamp);
    mrpt::obs::CSensoryFrame frame;
    frame.insert(observationOf(EventPacket{0, CheckedEvents({{t_ns, 120, 0, true}}), t_ns}));
    frame.insert(observation);
    try {
      builder.processActionObservation(action, frame);
    } catch (const std::invalid_argument&) {
      ++errors;
    }
  }
  builder.finish();
  EXPECT_GT(errors, 100);
  EXPECT_EQ(builder.getCurrentlyBuiltMapSize(), 3U);
}

TEST_P(BuilderInEitherMode, LogsChoicesOfOptionsAndOnceRoundedPoints) {
  for (const bool rests : {false, true}) {  // if true, fixed poses: one camera sees no scene
    SyntheticRecording recording(1.5, rests ? 1 : 2);
    for (StampedPose& pose : recording.poses) {
      pose.T_world_rig.translation.x() = 5e6 + (rests ? 0 : pose.T_world_rig.translation.x());
    }
    EventFusionOptions options = in();
    options.automatic = defaultOptions().automatic;
    CEventFusionMapBuilder builder(options);
    builder.logging_enable_console_output = false;
    MapperLog log;
    builder.logRegisterCallback(
        [&](std::string_view text, auto&&...) { log.lines.emplace_back(text); });
    play(builder, observationsOf(recording));
    for (int i = 0; i < 2; ++i) builder.getCurrentlyBuiltMetricMap();
    const std::uint64_t choices = builder.status().choices;
    EXPECT_GE(choices, 1U);
    EXPECT_EQ(log.count("options chosen from the data: "), choices);
    EXPECT_EQ(log.count("no-scene: "), rests ? choices : 0U);
    if (rests) continue;
    EXPECT_FALSE(builder.points()->empty());
    EXPECT_EQ(log.count("MRPT's maps have float points"), 1U);
  }
}

// --- Options -----------------------------------------------------------------------------------

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
    const char* text;  // the value 9 belongs to our section
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
