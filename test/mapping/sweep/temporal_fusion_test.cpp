// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <opencv2/core.hpp>

#include "mapping/keyframes/keyframe_mapper.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/dsi/kept_dsi.h"
#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/keyframes/random_recording.h"
#include "test/oracle/naive_mapper.h"

namespace efm {
namespace {

using test::errorOverMass;
using test::KeptDsi;
using test::same;
using Recording = test::RandomRecording;

constexpr Window kWindow = Recording::kWindow;

/// Every event with a pose of its own, so that nothing but rounding is left to differ.
KeyframeMapperOptions exactOptions(int planes, int subintervals) {
  KeyframeMapperOptions options;
  options.split = SplitFusionOptions::none();
  options.planes = {0.5, 4.0, planes, PlaneSpacing::kInverse};
  options.packets.packet_error_px = 0;
  options.subintervals.count = subintervals;
  options.sweep.threads = 1;
  return options;
}

struct Mapped {
  KeyframeDepthMap keyframe;
  std::vector<float> dsi;
};

Mapped mapWith(const Recording& recording, const KeyframeMapperOptions& options) {
  KeyframeMapper mapper(recording.rig, recording.cameras(), options);
  KeptDsi dsi(mapper.planes(), mapper.view());
  auto keyframe = mapper.map(kWindow, recording.spans(), recording.trajectory, &dsi);
  EXPECT_TRUE(keyframe);
  return {keyframe.value_or(KeyframeDepthMap()), dsi.values};
}

/// The oracle's DSIs by camera and sub-interval.
std::vector<std::vector<oracle::Dsi>> exactParts(const Recording& recording,
                                                 const KeyframeMapperOptions& options) {
  const KeyframeMapper mapper(recording.rig, recording.cameras(), options);
  const Rigid3 T_world_ref = mapper.referencePose(*recording.trajectory.poseAt(kWindow.t_ref_ns));
  std::vector<std::vector<oracle::Dsi>> parts;
  for (std::size_t c = 0; c < recording.events.size(); ++c) {
    const RigCamera& camera = recording.rig.cameras[c];
    const UndistortionTable undistortion(camera.model);
    auto& of_camera = parts.emplace_back();
    for (const auto& part :
         oracle::splitEvents(recording.events[c], kWindow.t0_ns, kWindow.t1_ns,
                             options.subintervals.count, options.subintervals.split)) {
      of_camera.push_back(
          oracle::rayDensity(oracle::poseEach(part, camera, recording.trajectory, T_world_ref),
                             undistortion, mapper.view(), mapper.planes()));
    }
  }
  return parts;
}

/// Puts the sub-intervals into the slots in which they meet.
std::vector<std::vector<oracle::Dsi>> shuffled(const std::vector<std::vector<oracle::Dsi>>& parts,
                                               const SubintervalOptions& options) {
  const auto slots = assignSubintervals(static_cast<int>(parts.size()), options);
  std::vector<std::vector<oracle::Dsi>> result;
  for (std::size_t c = 0; c < parts.size(); ++c) {
    auto& of_camera = result.emplace_back();
    for (const int part : slots[c]) of_camera.push_back(parts[c][static_cast<std::size_t>(part)]);
  }
  return result;
}

class TemporalFusionOn : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, TemporalFusionOn, ::testing::ValuesIn(availableKernels()),
                         test::nameOfKernel);

TEST_P(TemporalFusionOn, FromEventsToTheDsiItIsTheOraclesForAllRulesAndOrders) {
  for (int cameras = 1; cameras <= 3; ++cameras) {
    const Recording recording(20 + static_cast<std::uint32_t>(cameras), cameras, 1500);
    KeyframeMapperOptions options = exactOptions(2, 3);
    options.sweep.kernel = GetParam();
    options.view.width = 24;  // a quarter of the pixels, so that each has votes in every slot
    const auto parts = exactParts(recording, options);
    for (const FusionOrder order : {FusionOrder::kCamerasThenTime, FusionOrder::kTimeThenCameras}) {
      for (const FusionRule across_cameras : allFusionRules()) {
        for (const FusionRule across_time : allFusionRules()) {
          options.sweep.fusion = {across_cameras, across_time, order};
          EXPECT_LE(errorOverMass(mapWith(recording, options).dsi,
                                  oracle::fuse(options.sweep.fusion, parts)),
                    test::errorOverMassOf(GetParam()))
              << cameras << " cameras " << nameOf(across_cameras) << ", " << nameOf(across_time)
              << ", " << nameOf(order);
        }
      }
    }
  }
}

TEST_P(TemporalFusionOn, EverySplitAndShuffleIsTheOracles) {
  const Recording recording(31, 3, 5000);
  for (const int count : {2, 5}) {
    for (const auto split : {SubintervalSplit::kDuration, SubintervalSplit::kCount}) {
      KeyframeMapperOptions options = exactOptions(4, count);
      options.sweep.kernel = GetParam();
      options.subintervals.split = split;
      const auto parts = exactParts(recording, options);
      std::vector<std::vector<float>> dsis;
      for (const auto shuffle :
           {SubintervalShuffle::kNone, SubintervalShuffle::kShift, SubintervalShuffle::kRandom}) {
        options.subintervals.shuffle = shuffle;
        for (const auto order : {FusionOrder::kCamerasThenTime, FusionOrder::kTimeThenCameras}) {
          options.sweep.fusion.order = order;
          dsis.push_back(mapWith(recording, options).dsi);
          EXPECT_LE(errorOverMass(dsis.back(), oracle::fuse(options.sweep.fusion,
                                                            shuffled(parts, options.subintervals))),
                    test::errorOverMassOf(GetParam()))
              << count << " by " << nameOf(split) << ", " << nameOf(shuffle);
        }
      }
      EXPECT_NE(dsis[0], dsis[2]) << "a shift lets other sub-intervals meet";
    }
  }
}

TEST(TemporalFusion, ArithmeticAcrossTimeThenHarmonicAcrossCamerasIsAlgorithmOne) {
  const Recording recording(32, 2, 5000);
  KeyframeMapperOptions options = exactOptions(7, 1);
  options.sweep.kernel = VotingKernel::kPlain;  // which rounds the votes alike in both
  const std::vector<float> whole = mapWith(recording, options).dsi;
  for (const int count : {2, 3, 8}) {
    options.subintervals.count = count;
    options.sweep.fusion = {FusionRule::kHarmonic, FusionRule::kArithmetic,
                            FusionOrder::kTimeThenCameras};
    const std::vector<float> parts = mapWith(recording, options).dsi;
    ASSERT_EQ(parts.size(), whole.size());
    for (std::size_t i = 0; i < whole.size(); ++i) {
      // Means, not sums: 1/N_s of it. Votes of some 20 events per voxel, summed in another order.
      ASSERT_NEAR(static_cast<double>(parts[i]) * count, whole[i], 1e-5 * whole[i] + 1e-9);
    }
  }
}

/// Rays of all cameras and sub-intervals, as the keyframe mapper makes them.
std::vector<CameraRays> raysOf(const Recording& recording, const ReferenceView& view, int count) {
  std::vector<CameraRays> rays;
  SubintervalOptions subintervals;
  subintervals.count = count;
  for (std::size_t c = 0; c < recording.events.size(); ++c) {
    const RigCamera& camera = recording.rig.cameras[c];
    const UndistortionTable undistortion(camera.model);
    const PacketGeometry geometry{{}, view, 0.5, 4.0};
    auto& of_camera = rays.emplace_back();
    for (const EventSpan part : splitIntoSubintervals(EventSpan(recording.events[c]), kWindow.t0_ns,
                                                      kWindow.t1_ns, subintervals)) {
      const PosePackets packets =
          splitIntoPosePackets(part, camera, undistortion, recording.trajectory, geometry, {0.02});
      of_camera.push_back(backProject(part, packets, undistortion, view));
    }
  }
  return rays;
}

TEST_P(TemporalFusionOn, TheNumberOfThreadsNeverChangesABitOfAnyPeak) {
  const tbb::global_control as_if_sixteen_cores(tbb::global_control::max_allowed_parallelism, 16);
  const Recording recording(33, 3, 3000);
  const ReferenceView view = ReferenceView::of(test::smallCamera());
  const std::vector<CameraRays> rays = raysOf(recording, view, 4);
  for (const int planes : {1, 2, 31, 40}) {
    const DepthPlanes depths({0.5, 4.0, planes, PlaneSpacing::kInverse});
    for (const FusionOrder order : {FusionOrder::kCamerasThenTime, FusionOrder::kTimeThenCameras}) {
      SpaceSweepOptions options;
      options.fusion.order = order;
      options.kernel = GetParam();
      options.threads = 1;
      const SweepResult one = SpaceSweep(options).run(rays, view, depths, {true, nullptr});
      ASSERT_EQ(one.cameras.size(), 3U);
      for (const int threads : {2, 3, 16}) {
        options.threads = threads;
        EXPECT_EQ(options.threadsOrCores(), threads);
        const SweepResult many = SpaceSweep(options).run(rays, view, depths, {true, nullptr});
        EXPECT_TRUE(same(one.fused.peaks, many.fused.peaks)) << planes << " planes, " << threads;
        ASSERT_EQ(many.cameras.size(), 3U);
        for (std::size_t c = 0; c < 3; ++c) {
          EXPECT_TRUE(same(one.cameras[c].peaks, many.cameras[c].peaks))
              << "camera " << c << ", " << planes << " planes, " << threads << " threads";
          EXPECT_EQ(one.votes[c].total(), many.votes[c].total());
          EXPECT_EQ(one.votes[c].cast, many.votes[c].cast);
        }
      }
    }
  }
}

TEST(TemporalFusion, ACamerasPeaksAreThoseOfItsOwnSweep) {
  const Recording recording(34, 3, 3000);
  const ReferenceView view = ReferenceView::of(test::smallCamera());
  const DepthPlanes planes({0.5, 4.0, 20, PlaneSpacing::kInverse});
  for (const int count : {1, 4}) {
    const std::vector<CameraRays> rays = raysOf(recording, view, count);
    for (const FusionRule across_time : allFusionRules()) {
      SpaceSweepOptions options;
      options.fusion.across_time = across_time;
      const SweepResult all = SpaceSweep(options).run(rays, view, planes, {true, nullptr});
      EXPECT_TRUE(same(all.fused.peaks, SpaceSweep(options).run(rays, view, planes).fused.peaks))
          << "keeping the cameras changes nothing";
      for (std::size_t c = 0; c < rays.size(); ++c) {
        const DsiPeaks alone = SpaceSweep(options).run({rays[c]}, view, planes).fused.peaks;
        EXPECT_TRUE(same(all.cameras[c].peaks, alone)) << "camera " << c << ", " << count;
      }
    }
  }
}

TEST(TemporalFusion, ASilentSubintervalSilencesTheAndLikeRulesInItsSlotOnly) {
  const Recording recording(35, 2, 4000);
  const ReferenceView view = ReferenceView::of(test::smallCamera());
  const DepthPlanes planes({0.5, 4.0, 5, PlaneSpacing::kInverse});
  std::vector<CameraRays> rays = raysOf(recording, view, 2);
  rays[1][0] = RayBundle();
  const auto confidence = [&](FusionRule across_time, FusionOrder order) {
    SpaceSweepOptions options;
    options.fusion = {FusionRule::kHarmonic, across_time, order};
    return SpaceSweep(options).run(rays, view, planes).fused.peaks.confidence;
  };
  const auto cameras_first = FusionOrder::kCamerasThenTime;
  EXPECT_EQ(cv::countNonZero(confidence(FusionRule::kHarmonic, cameras_first)), 0);
  EXPECT_EQ(cv::countNonZero(confidence(FusionRule::kHarmonic, FusionOrder::kTimeThenCameras)), 0);
  EXPECT_GT(cv::countNonZero(confidence(FusionRule::kArithmetic, cameras_first)), 0);
}

}  // namespace
}  // namespace efm
