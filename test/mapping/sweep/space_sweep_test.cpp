// SPDX-License-Identifier: BSD-3-Clause
// From events to the DSI against the oracle, and the other results of a sweep.
#include "mapping/sweep/space_sweep.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <opencv2/core.hpp>

#include "mapping/events/window.h"
#include "mapping/keyframes/keyframe_mapper.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/dsi/chosen_dsi.h"
#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/keyframes/random_scene.h"
#include "test/oracle/naive_mapper.h"

namespace efm {
namespace {

using test::errorOverMass;
using test::same;
using test::WholeDsi;
using Recording = test::RandomRecording;

constexpr Window kWindow = Recording::kWindow;

/// Every event with a pose of its own, so that only rounding differs.
KeyframeMapperOptions exactOptions(const SplitFusionOptions& split, int subintervals) {
  KeyframeMapperOptions options;
  options.split = split;
  options.extraction.extraction = ExtractionMethod::kPaper;  // only the DSI matters
  options.planes = {0.5, 4.0, 2, PlaneSpacing::kInverse};
  options.view.width = 24;  // a quarter of the pixels, so that each has votes in every group
  options.packets.packet_error_px = 0;
  options.subintervals.count = subintervals;
  options.sweep.threads = 1;
  return options;
}

std::vector<float> dsiOf(const Recording& recording, const KeyframeMapperOptions& options,
                         const Window& window = kWindow) {
  KeyframeMapper mapper(recording.rig, recording.cameras(), options);
  WholeDsi dsi(mapper.planes(), mapper.view());
  EXPECT_TRUE(mapper.map(window, recording.spans(), recording.trajectory, &dsi));
  return dsi.values;
}

/// The oracle's ray densities, [camera][sub-interval of the window][polarity]. Without a split by
/// polarity all events have polarity 0.
using Parts = std::vector<std::vector<std::vector<oracle::Dsi>>>;

Parts exactParts(const Recording& recording, const KeyframeMapperOptions& options) {
  const KeyframeMapper mapper(recording.rig, recording.cameras(), options);
  const Rigid3 T_world_ref = mapper.referencePose(*recording.trajectory.poseAt(kWindow.t_ref_ns));
  const int count = options.subintervals.count * options.split.time_slices;
  Parts parts;
  for (std::size_t c = 0; c < recording.events.size(); ++c) {
    const RigCamera& camera = recording.rig.cameras[c];
    const UndistortionTable undistortion(camera.model);
    auto& of_camera = parts.emplace_back();
    for (const auto& events : oracle::splitEvents(recording.events[c], kWindow.t0_ns, kWindow.t1_ns,
                                                  count, options.subintervals.split)) {
      std::vector<std::vector<Event>> by_polarity(options.split.polarity ? 2 : 1);
      for (const Event& event : events) {
        by_polarity[options.split.polarity && event.polarity ? 1 : 0].push_back(event);
      }
      auto& of_part = of_camera.emplace_back();
      for (const auto& group : by_polarity) {
        of_part.push_back(
            oracle::rayDensity(oracle::poseEach(group, camera, recording.trajectory, T_world_ref),
                               undistortion, mapper.view(), mapper.planes()));
      }
    }
  }
  return parts;
}

/// The sum over slices and polarities of the fused cameras and sub-intervals. Of a single camera:
/// the sum over polarities of the fused slices and sub-intervals.
oracle::Dsi exactDsi(const Parts& parts, const KeyframeMapperOptions& options) {
  const auto subintervals = static_cast<std::size_t>(options.subintervals.count);
  const std::size_t slices = parts[0].size() / subintervals;
  const auto slots = assignSubintervals(static_cast<int>(parts.size()), options.subintervals);
  const auto input = [&](std::size_t camera, std::size_t slice, std::size_t polarity) {
    std::vector<oracle::Dsi> by_slot;
    for (const int part : slots[camera]) {
      by_slot.push_back(
          parts[camera][slice * subintervals + static_cast<std::size_t>(part)][polarity]);
    }
    return by_slot;
  };
  oracle::Dsi sum = parts[0][0][0];
  std::fill(sum.values.begin(), sum.values.end(), 0.0);
  const auto addFused = [&](const std::vector<std::vector<oracle::Dsi>>& inputs) {
    const oracle::Dsi fused = oracle::fuse(options.sweep.fusion, inputs);
    for (std::size_t i = 0; i < sum.values.size(); ++i) sum.values[i] += fused.values[i];
  };
  for (std::size_t polarity = 0; polarity < parts[0][0].size(); ++polarity) {
    std::vector<std::vector<oracle::Dsi>> inputs;
    for (std::size_t slice = 0; slice < slices; ++slice) {
      for (std::size_t c = 0; c < parts.size(); ++c) inputs.push_back(input(c, slice, polarity));
      if (parts.size() == 1 && slice + 1 < slices) continue;
      addFused(inputs);
      inputs.clear();
    }
  }
  return sum;
}

class SpaceSweepOn : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, SpaceSweepOn, ::testing::ValuesIn(availableKernels()),
                         test::nameOfKernel);

TEST_P(SpaceSweepOn, FromEventsTheDsiIsTheOraclesForAllRulesOrdersAndSplits) {
  const struct {
    SplitFusionOptions split;
    int subintervals;
    std::vector<FusionRule> across_time;
  } cases[] = {{SplitFusionOptions::none(), 1, {FusionRule::kArithmetic}},
               {SplitFusionOptions::none(), 3, allFusionRules()},
               {{true, 2}, 1, {FusionRule::kRms}},
               {{true, 2}, 2, {FusionRule::kRms}},
               {{false, 3}, 2, {FusionRule::kRms}},
               {{true, 1}, 2, {FusionRule::kRms}}};
  for (int cameras = 1; cameras <= 3; ++cameras) {
    const Recording recording(40 + static_cast<std::uint32_t>(cameras), cameras, 4000);
    for (const auto& c : cases) {
      KeyframeMapperOptions options = exactOptions(c.split, c.subintervals);
      options.sweep.kernel = GetParam();
      const Parts parts = exactParts(recording, options);
      for (const FusionRule across_cameras : allFusionRules()) {
        for (const FusionRule across_time : c.across_time) {
          for (const auto order : {FusionOrder::kCamerasThenTime, FusionOrder::kTimeThenCameras}) {
            options.sweep.fusion = {across_cameras, across_time, order};
            EXPECT_LE(errorOverMass(dsiOf(recording, options), exactDsi(parts, options)),
                      test::errorOverMassOf(GetParam()))
                << cameras << " cameras " << nameOf(across_cameras) << ", " << nameOf(across_time)
                << ", " << nameOf(order) << ", polarities " << c.split.polarities() << ", slices "
                << c.split.time_slices << " of " << c.subintervals;
          }
        }
      }
    }
  }
}

// ---------------------------------------------------------------- other results

/// Rays of all cameras and sub-intervals, as the keyframe mapper makes them, and the oracle's
/// counts of their votes.
struct SweepRays {
  ReferenceView view = ReferenceView::of(test::smallCamera());
  DepthPlanes planes;
  std::vector<CameraRays> cameras;
  std::vector<VoteCounts> counts;
};

SweepRays raysOf(const Recording& recording, int planes, int subinterval_count) {
  SweepRays rays;
  rays.planes = DepthPlanes({0.5, 4.0, planes, PlaneSpacing::kInverse});
  SubintervalOptions subintervals;
  subintervals.count = subinterval_count;
  for (std::size_t c = 0; c < recording.events.size(); ++c) {
    const RigCamera& camera = recording.rig.cameras[c];
    const UndistortionTable undistortion(camera.model);
    const PacketGeometry geometry{{}, rays.view, 0.5, 4.0};
    auto& of_camera = rays.cameras.emplace_back();
    VoteCounts& counts = rays.counts.emplace_back();
    for (const EventSpan part : splitIntoSubintervals(EventSpan(recording.events[c]), kWindow.t0_ns,
                                                      kWindow.t1_ns, subintervals)) {
      const PosePackets packets =
          splitIntoPosePackets(part, camera, undistortion, recording.trajectory, geometry, {0.02});
      of_camera.push_back(backProject(part, packets, undistortion, rays.view));
      VoteCounts of_part;
      oracle::rayDensity(
          oracle::poseByPacket(std::vector<Event>(part.begin(), part.end()), packets), undistortion,
          rays.view, rays.planes, &of_part);
      counts += of_part;
    }
  }
  return rays;
}

SweepResult sweepRays(const SweepRays& rays, const SpaceSweepOptions& options,
                      const SweepRequest& request = {}) {
  return sweepSpace(rays.cameras, {rays.view, rays.planes}, options, request);
}

TEST_P(SpaceSweepOn, VotesAreCountedAsTheOracleCountsThem) {
  const SweepRays rays = raysOf(Recording(8, 2, 3000), 9, 1);
  SpaceSweepOptions options;
  options.kernel = GetParam();
  const SweepResult result = sweepRays(rays, options);
  ASSERT_EQ(result.votes.size(), 2U);
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_EQ(result.votes[c].total(), rays.cameras[c][0].size() * 9);
    EXPECT_EQ(result.votes[c].behind_camera, rays.counts[c].behind_camera);
    // A vote within 1/4096 px of the border may fall on either side of it: of 27,000 votes over
    // 48 x 36 px, some 27,000 * 2 * (1/48 + 1/36) / 4096 = 0.6.
    EXPECT_NEAR(static_cast<double>(result.votes[c].cast), static_cast<double>(rays.counts[c].cast),
                3);
  }
}

TEST_P(SpaceSweepOn, PeaksAndTheirNeighboursAreThoseOfTheDsi) {
  for (const int planes : {1, 2, 3, 17}) {
    const SweepRays rays = raysOf(Recording(9, 2, 3000), planes, 1);
    SpaceSweepOptions options;
    options.kernel = GetParam();
    WholeDsi dsi(rays.planes, rays.view);
    const DsiPeaks peaks = sweepRays(rays, options, {false, &dsi}).fused.peaks;
    test::ChosenDsi chosen({rays.view.width, rays.view.height}, planes);
    ASSERT_TRUE(dsi.isComplete());
    chosen.values = dsi.values;
    EXPECT_TRUE(same(peaks, chosen.swept().peaks)) << planes;
  }
}

TEST(SpaceSweep, ACamerasPeaksAreThoseOfItsOwnSweep) {
  const Recording recording(34, 3, 3000);
  for (const int count : {1, 4}) {
    const SweepRays rays = raysOf(recording, 20, count);
    for (const FusionRule across_time : allFusionRules()) {
      SpaceSweepOptions options;
      options.fusion.across_time = across_time;
      const SweepResult all = sweepRays(rays, options, {true});
      for (std::size_t c = 0; c < rays.cameras.size(); ++c) {
        SweepRays own = rays;
        own.cameras = {rays.cameras[c]};
        EXPECT_TRUE(same(all.cameras[c].peaks, sweepRays(own, options).fused.peaks))
            << "camera " << c << ", " << count;
      }
    }
  }
}

TEST(SpaceSweep, OptionsHaveTheirLimits) {
  using O = SpaceSweepOptions;
  EXPECT_THROW(sweepSpace({{RayBundle()}}, DsiGrid(), {{}, 0, {}}), std::invalid_argument);
  const tbb::global_control two_cores(tbb::global_control::max_allowed_parallelism, 2);
  EXPECT_EQ(O().threadsOrCores(), 2);
  O three;
  three.threads = 3;
  EXPECT_EQ(three.threadsOrCores(), 2) << "never more than there are cores";
  three.threads = 1;
  EXPECT_EQ(three.threadsOrCores(), 1);
}

}  // namespace
}  // namespace efm
