// SPDX-License-Identifier: BSD-3-Clause
// The map builder with refinement of poses.

#include <gtest/gtest.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/poses/CPose3DPDFGaussian.h>

#include <Eigen/Eigenvalues>
#include <atomic>
#include <thread>

#include "plugin/mrpt/CEventFusionMapBuilder.h"
#include "test/plugin/mrpt/observations.h"
#include "test/plugin/session/synthetic_recording.h"

namespace efm {
namespace {

using mrpt::obs::CObservation;
using mrpt::obs::CObservationRobotPose;
using Observations = std::vector<CObservation::Ptr>;

EventFusionOptions optionsOf(bool background) {
  EventFusionOptions options = refinedOptions();
  options.refinement.background = background;
  return options;
}

Observations shakenObservations(double duration_s = 1.3) {
  return observationsOf(shaken(SyntheticRecording(duration_s)));
}

void expectSamePoses(const std::vector<StampedPose>& a, const std::vector<StampedPose>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].t_ns, b[i].t_ns);
    EXPECT_TRUE(isSame(a[i].T_world_rig, b[i].T_world_rig)) << "keyframe " << i;
  }
}

/// Compares the results of all queries, in two orders.
void expectQueriesToAgree(CEventFusionMapBuilder& builder, bool points_first) {
  builder.getCurrentlyBuiltMapSize();
  MapCloud::ConstPtr points;
  if (points_first) points = builder.points();
  const std::vector<StampedPose> trajectory = builder.trajectory();
  if (!points_first) points = builder.points();
  expectSamePoses(builder.trajectory(), trajectory);
  EXPECT_EQ(builder.trackerTrajectory().size(), trajectory.size());

  mrpt::maps::CSimpleMap simplemap;
  builder.getCurrentlyBuiltMap(simplemap);
  ASSERT_EQ(simplemap.size(), trajectory.size());
  GlobalCloud cloud(builder.usedOptions().cloud);
  std::size_t number = 0;
  for (const StoredKeyframe& keyframe : keyframesOf(simplemap)) {
    const Rigid3& T_world_ref = trajectory[number].T_world_rig;
    EXPECT_EQ(keyframe.T_world_ref.translation, T_world_ref.translation);
    EXPECT_LT(keyframe.T_world_ref.rotation.angularDistance(T_world_ref.rotation), 1e-14);
    // The simplemap's angles may round: the cloud is compared at the exact pose.
    cloud.insert(number++, pointsInWorld(*keyframe.points, T_world_ref), T_world_ref);
  }
  expectSameBits(cloud.points(), withoutSigma(points));
  const auto* metric = builder.getCurrentlyBuiltMetricMap();
  expectSameBits(metric->mapByClass<CEventFusionMap>()->cloud().points(), points);
}

TEST(RefinedBuilder, AllQueriesAgreeAtAnyTimeAndChangeNothing) {
  const Observations observations = shakenObservations();
  CEventFusionMapBuilder undisturbed(optionsOf(false));
  play(undisturbed, observations);
  CEventFusionMapBuilder builder(optionsOf(false));
  std::size_t taken = 0;
  builder.setKeyframeCallback([&](const KeyframeDepthMap& keyframe) {
    expectQueriesToAgree(builder, taken++ % 2 == 0);
    const StampedPose newest = builder.trajectory().back();
    EXPECT_EQ(newest.t_ns, keyframe.window.t_ref_ns);
    EXPECT_TRUE(isSame(newest.T_world_rig, keyframe.T_world_ref));
  });
  for (std::size_t i = 0; i < observations.size(); ++i) {
    builder.processObservation(observations[i]);
    builder.points();
    if (i % 23 == 7) expectQueriesToAgree(builder, i % 2 == 0);
  }
  builder.finish();
  builder.finish();  // it changes nothing
  expectQueriesToAgree(builder, true);
  EXPECT_GE(taken, 10U);
  EXPECT_EQ(builder.trajectory().size(), taken);
  expectSamePoses(builder.trajectory(), undisturbed.trajectory());
  expectSamePoses(builder.trackerTrajectory(), undisturbed.trackerTrajectory());
  expectSameBits(builder.points(), undisturbed.points());
}

TEST(RefinedBuilder, KeyframesOfAnEarlierMapStayAndAllAgree) {
  const Observations observations = shakenObservations(0.9);
  CEventFusionMapBuilder first(optionsOf(false));
  play(first, observations);
  mrpt::maps::CSimpleMap earlier;
  first.getCurrentlyBuiltMap(earlier);
  const std::size_t count = earlier.size();

  CEventFusionMapBuilder builder(optionsOf(false));
  builder.initialize(earlier);
  const auto before = builder.trajectory();
  ASSERT_EQ(before.size(), count);
  for (std::size_t i = 0; i < observations.size(); ++i) {
    builder.processObservation(observations[i]);
    if (i % 41 == 0) expectQueriesToAgree(builder, i % 2 == 0);
  }
  builder.finish();
  expectQueriesToAgree(builder, true);
  const auto trajectory = builder.trajectory();
  const auto tracker = builder.trackerTrajectory();
  ASSERT_EQ(trajectory.size(), 2 * count);
  for (std::size_t i = 0; i < count; ++i) {
    EXPECT_TRUE(isSame(trajectory[i].T_world_rig, before[i].T_world_rig));
    EXPECT_TRUE(isSame(tracker[i].T_world_rig, before[i].T_world_rig));
    EXPECT_TRUE(isSame(tracker[count + i].T_world_rig, first.trackerTrajectory()[i].T_world_rig));
    EXPECT_TRUE(isSame(trajectory[count + i].T_world_rig, first.trajectory()[i].T_world_rig));
  }
  builder.clear();
  EXPECT_TRUE(builder.points()->empty());
}

// --- The current pose --------------------------------------------------------------------------

mrpt::poses::CPose3DPDFGaussian estimateOf(const CEventFusionMapBuilder& builder) {
  const auto estimate = std::dynamic_pointer_cast<mrpt::poses::CPose3DPDFGaussian>(
      builder.getCurrentPoseEstimation());
  EXPECT_TRUE(estimate);
  return *estimate;
}

TEST(RefinedBuilder, TheCurrentPoseIsTheTrackersCorrected) {
  const SyntheticRecording recording = shaken(SyntheticRecording(1.3));
  CEventFusionMapBuilder builder(optionsOf(false));
  EXPECT_TRUE(isSame(rigidFrom(estimateOf(builder).mean), Rigid3{}));
  std::size_t pose = 0;
  for (const auto& observation : observationsOf(recording)) {
    builder.processObservation(observation);
    if (!IS_CLASS(*observation, CObservationRobotPose)) continue;
    const Rigid3& T_odom_rig = recording.poses[pose++].T_world_rig;
    const auto refinement = builder.status().refinement;
    ASSERT_TRUE(refinement);
    const Rigid3 T_world_rig = refinement->T_world_odom * T_odom_rig;
    const auto estimate = estimateOf(builder);
    EXPECT_LT((rigidFrom(estimate.mean).translation - T_world_rig.translation).norm(), 1e-9);
    EXPECT_LT(rigidFrom(estimate.mean).rotation.angularDistance(T_world_rig.rotation), 1e-9);
    if (builder.trajectory().size() < 2) continue;
    const Eigen::Matrix<double, 6, 6> covariance = estimate.cov.asEigen();
    EXPECT_LT((covariance - covariance.transpose()).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(covariance).eigenvalues()(0), 0);
    EXPECT_LT(covariance.diagonal().maxCoeff(), 0.01);
  }
  EXPECT_GT(builder.status().refinement->T_world_odom.translation.norm(), 1e-4);
}

// --- Covariances of pose observations ----------------------------------------------------------

TEST(RefinedBuilder, CovariancesOfPosesLimitTheMotionOfKeyframes) {
  EventFusionOptions options = optionsOf(false);
  options.refinement.refiner.adapt_tracker = false;
  options.refinement.refiner.tracker.drift_m = 0;
  options.refinement.refiner.tracker.drift_rad = 0;
  CEventFusionMapBuilder builder(options);
  for (const auto& observation : shakenObservations()) {
    if (const auto pose = std::dynamic_pointer_cast<CObservationRobotPose>(observation)) {
      const auto window =
          (nanosecondsFrom(pose->timestamp) - SyntheticRecording::kStartNs) / kShakenWindowNs;
      for (int i = 0; i < 6; ++i) {
        const double sigma = window % 2 == 0 ? (i < 3 ? 1e-4 : 1e-5) : (i < 3 ? 0.05 : 0.02);
        pose->pose.cov(i, i) = sigma * sigma;
      }
    }
    builder.processObservation(observation);
  }
  builder.finish();
  const auto tracker = builder.trackerTrajectory();
  const auto refined = builder.trajectory();
  double certain_m = 0;
  double noisy_m = 0;
  for (std::size_t k = 1; k < refined.size(); ++k) {
    (k % 2 == 0 ? certain_m : noisy_m) +=
        (refined[k].T_world_rig.translation - tracker[k].T_world_rig.translation).norm();
  }
  EXPECT_LT(certain_m, 0.2 * noisy_m);
}

// --- In the background -------------------------------------------------------------------------

TEST(RefinedBuilder, InTheBackgroundMayEndOrStartOverWhileKeyframesWait) {
  const Observations observations = shakenObservations();
  for (int round = 0; round < 3; ++round) {
    CEventFusionMapBuilder builder(optionsOf(true));
    feed(builder, observations);
    if (round == 1) builder.clear();
    if (round == 2) builder.setOptions(optionsOf(false));
    EXPECT_EQ(builder.trajectory().empty(), round > 0);
  }
}

TEST(RefinedBuilder, ThreadsMayFeedAndQueryWithAndWithoutRefinement) {
  // Poses before all and a packet of each camera, then a thread per camera. No thread is ahead of
  // the other by more than the mapper waits.
  const Observations observations = shakenObservations(0.9);
  for (const bool refined : {false, true}) {
    EventFusionOptions options = optionsOf(true);
    options.refinement.enabled = refined;
    CEventFusionMapBuilder builder(options);
    std::atomic<std::size_t> delivered = 0;
    builder.setKeyframeCallback([&](const KeyframeDepthMap&) { ++delivered; });
    Observations packets;
    for (const auto& observation : observations) {
      if (IS_CLASS(*observation, CObservationRobotPose)) {
        builder.processObservation(observation);
      } else {
        packets.push_back(observation);
      }
    }
    for (std::size_t i = 0; i < 2; ++i) builder.processObservation(packets[i]);
    packets.erase(packets.begin(), packets.begin() + 2);
    std::vector<std::thread> feeders;
    for (const std::string camera : {"cam0", "cam1"}) {
      feeders.emplace_back([&, camera] {
        for (const auto& packet : packets) {
          if (packet->sensorLabel != camera) continue;
          builder.processObservation(packet);
          builder.getCurrentlyBuiltMapSize();
        }
      });
    }
    std::atomic<bool> done = false;
    std::thread querier([&] {
      while (!done) {
        const auto tracker = builder.trackerTrajectory();
        for (std::size_t i = 1; i < tracker.size(); ++i) {
          EXPECT_LT(tracker[i - 1].t_ns, tracker[i].t_ns);
        }
        mrpt::maps::CSimpleMap map;
        builder.getCurrentlyBuiltMap(map);
        EXPECT_EQ(keyframesOf(map).size(), map.size());
        estimateOf(builder);
        builder.points();
        builder.status();
        builder.getCurrentlyBuiltMetricMap();
      }
    });
    for (std::thread& feeder : feeders) feeder.join();
    builder.finish();
    done = true;
    querier.join();
    EXPECT_EQ(delivered, builder.getCurrentlyBuiltMapSize());
    options.refinement.background = false;
    CEventFusionMapBuilder alone(options);
    play(alone, observations);
    if (!refined) expectSamePoses(alone.trajectory(), alone.trackerTrajectory());
    expectQueriesToAgree(builder, true);
    expectSamePoses(builder.trajectory(), alone.trajectory());
    expectSameBits(builder.points(), alone.points());
  }
}

}  // namespace
}  // namespace efm
