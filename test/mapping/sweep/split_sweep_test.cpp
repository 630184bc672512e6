// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <vector>

#include "mapping/keyframes/keyframe_mapper.h"
#include "test/mapping/depth/same_image.h"
#include "test/mapping/dsi/kept_dsi.h"
#include "test/mapping/dsi/swept_dsi.h"
#include "test/mapping/kernels/fast_kernels.h"
#include "test/mapping/keyframes/random_recording.h"
#include "test/mapping/rays/random_rays.h"
#include "test/mapping/sweep/plain_sweep.h"
#include "test/oracle/naive_mapper.h"

namespace efm {
namespace {

using test::errorOverMass;
using test::KeptDsi;
using test::RandomRays;
using test::SweepCase;
using Recording = test::RandomRecording;

constexpr Window kWindow = Recording::kWindow;

/// Every event with a pose of its own, so that nothing but rounding is left to differ.
KeyframeMapperOptions exactOptions(const SplitFusionOptions& split, int subintervals) {
  KeyframeMapperOptions options;
  options.split = split;
  options.extraction.extraction = ExtractionMethod::kPaper;  // the DSI is all that matters
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
  KeptDsi dsi(mapper.planes(), mapper.view());
  EXPECT_TRUE(mapper.map(window, recording.spans(), recording.trajectory, &dsi));
  return dsi.values;
}

/// The oracle's ray densities, [camera][part of the window in time][polarity]; of a window without
/// a split by polarity, all events are of polarity 0.
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

void add(oracle::Dsi& sum, const oracle::Dsi& term) {
  for (std::size_t i = 0; i < sum.values.size(); ++i) sum.values[i] += term.values[i];
}

/// The sum over slices and polarities of what cameras and sub-intervals give together; of a single
/// camera the sum over polarities of what slices and sub-intervals give.
oracle::Dsi exactSplit(const Parts& parts, const KeyframeMapperOptions& options) {
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
  for (std::size_t polarity = 0; polarity < parts[0][0].size(); ++polarity) {
    if (parts.size() == 1) {
      std::vector<std::vector<oracle::Dsi>> inputs;
      for (std::size_t slice = 0; slice < slices; ++slice) {
        inputs.push_back(input(0, slice, polarity));
      }
      add(sum, oracle::fuse(options.sweep.fusion, inputs));
      continue;
    }
    for (std::size_t slice = 0; slice < slices; ++slice) {
      std::vector<std::vector<oracle::Dsi>> inputs;
      for (std::size_t c = 0; c < parts.size(); ++c) inputs.push_back(input(c, slice, polarity));
      add(sum, oracle::fuse(options.sweep.fusion, inputs));
    }
  }
  return sum;
}

SplitFusionOptions splitInto(bool polarity, int slices) {
  SplitFusionOptions split;
  split.polarity = polarity;
  split.time_slices = slices;
  return split;
}

class SplitSweepOn : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, SplitSweepOn, ::testing::ValuesIn(availableKernels()),
                         test::nameOfKernel);

TEST_P(SplitSweepOn, FromEventsToTheDsiItIsTheOraclesForAllRulesAndSplits) {
  for (int cameras = 1; cameras <= 3; ++cameras) {
    const Recording recording(40 + static_cast<std::uint32_t>(cameras), cameras, 4000);
    for (const auto& split : {splitInto(true, 2), splitInto(false, 3), splitInto(true, 1)}) {
      for (const int subintervals : {1, 2}) {
        KeyframeMapperOptions options = exactOptions(split, subintervals);
        options.sweep.kernel = GetParam();
        const Parts parts = exactParts(recording, options);
        for (const FusionRule across_cameras : allFusionRules()) {
          for (const auto order : {FusionOrder::kCamerasThenTime, FusionOrder::kTimeThenCameras}) {
            options.sweep.fusion = {across_cameras, FusionRule::kRms, order};
            EXPECT_LE(errorOverMass(dsiOf(recording, options), exactSplit(parts, options)),
                      test::errorOverMassOf(GetParam()))
                << cameras << " cameras " << nameOf(across_cameras) << ", " << nameOf(order)
                << ", polarities " << split.polarities() << ", slices " << split.time_slices
                << " of " << subintervals;
          }
        }
      }
    }
  }
}

TEST_P(SplitSweepOn, ShufflesAndCountsOfSubintervalsInsideSlicesAreTheOracles) {
  const Recording recording(51, 3, 8000);
  for (const auto by : {SubintervalSplit::kDuration, SubintervalSplit::kCount}) {
    KeyframeMapperOptions options = exactOptions(splitInto(true, 2), 4);
    options.sweep.kernel = GetParam();
    options.subintervals.split = by;
    const Parts parts = exactParts(recording, options);
    for (const auto shuffle :
         {SubintervalShuffle::kNone, SubintervalShuffle::kShift, SubintervalShuffle::kRandom}) {
      options.subintervals.shuffle = shuffle;
      EXPECT_LE(errorOverMass(dsiOf(recording, options), exactSplit(parts, options)),
                test::errorOverMassOf(GetParam()))
          << nameOf(by) << ", " << nameOf(shuffle);
    }
  }
}

/// Of one polarity alone.
Recording ofPolarity(Recording recording, bool polarity) {
  for (auto& events : recording.events) {
    events.erase(std::remove_if(events.begin(), events.end(),
                                [&](const Event& event) { return event.polarity != polarity; }),
                 events.end());
  }
  return recording;
}

/// Of a slice of time alone.
Recording ofSlice(Recording recording, const Window& slice) {
  for (auto& events : recording.events) {
    events.erase(std::remove_if(events.begin(), events.end(),
                                [&](const Event& event) {
                                  return event.t_ns < slice.t0_ns || event.t_ns >= slice.t1_ns;
                                }),
                 events.end());
  }
  return recording;
}

TEST(SplitSweep, TheDsiIsTheSumOfThoseOfItsGroupsMappedAlone) {
  const Recording recording(52, 2, 4000);
  const std::int64_t middle_ns = kWindow.t0_ns + Recording::kDuration_ns / 2;
  KeyframeMapperOptions options = exactOptions(splitInto(true, 2), 2);
  options.sweep.kernel = VotingKernel::kPlain;  // which casts each vote by itself
  const std::vector<float> split = dsiOf(recording, options);
  options.split = SplitFusionOptions::none();
  std::vector<float> sum(split.size());
  for (const Window& slice : {Window{kWindow.t0_ns, middle_ns, kWindow.t_ref_ns},
                              Window{middle_ns, kWindow.t1_ns, kWindow.t_ref_ns}}) {
    for (const bool polarity : {false, true}) {
      const std::vector<float> alone =
          dsiOf(ofPolarity(ofSlice(recording, slice), polarity), options, slice);
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += alone[i];
    }
  }
  EXPECT_GT(*std::max_element(sum.begin(), sum.end()), 0);
  EXPECT_EQ(split, sum);
}

SweepCase casesOfGroups(std::uint32_t seed, const cv::Size& size, const FusionInputs& inputs) {
  RandomRays random(seed);
  SweepCase input{random.view(size), DepthPlanes({0.5, 5.0, 9, PlaneSpacing::kInverse}), {}};
  for (int camera = 0; camera < inputs.cameras; ++camera) {
    CameraRays& of_camera = input.cameras.emplace_back();
    for (int slot = 0; slot < inputs.slots * inputs.groups; ++slot) {
      of_camera.push_back(random.bundle(input.view, input.planes, random.integer(0, 2500)));
    }
  }
  input.groups = inputs.groups;
  return input;
}

class SplitSweepOnFast : public ::testing::TestWithParam<VotingKernel> {};

INSTANTIATE_TEST_SUITE_P(Kernels, SplitSweepOnFast, ::testing::ValuesIn(test::fastKernels()),
                         test::nameOfKernel);

TEST_P(SplitSweepOnFast, GroupsOfRandomRigsAreThePlainKernelsWithinRounding) {
  std::uint32_t seed = 60;
  for (const FusionInputs inputs :
       {FusionInputs{1, 1, 2}, {2, 1, 2}, {2, 1, 4}, {2, 2, 4}, {3, 1, 4}, {4, 2, 2}}) {
    for (const cv::Size& size : {cv::Size(64, 64), {130, 70}, {40, 127}}) {
      SweepCase input = casesOfGroups(++seed, size, inputs);
      for (const bool camera_peaks : {false, true}) {
        input.camera_peaks = camera_peaks;
        SCOPED_TRACE(testing::Message()
                     << inputs.cameras << " cameras, " << inputs.slots << " slots, "
                     << inputs.groups << " groups, " << size.width << " x " << size.height);
        test::expectThePlainSweep(input, GetParam());
      }
    }
  }
}

/// Where two cameras meet in pairs, votes wait until it is known which matter.
TEST_P(SplitSweepOnFast, WhatIsAskedForBesideItChangesNoBitOfTheFusedDsi) {
  const tbb::global_control as_if_eight_cores(tbb::global_control::max_allowed_parallelism, 8);
  for (const FusionRule rule :
       {FusionRule::kHarmonic, FusionRule::kGeometric, FusionRule::kArithmetic}) {
    for (const FusionInputs inputs : {FusionInputs{2, 1, 1}, {2, 1, 4}, {3, 1, 2}, {2, 2, 2}}) {
      SweepCase input = casesOfGroups(80, {130, 70}, inputs);
      input.fusion.across_cameras = rule;
      input.camera_peaks = false;
      const test::SweptDsi alone = sweep(input, GetParam(), 1);
      input.camera_peaks = true;
      input.ray_window = 5;
      for (const int threads : {1, 8}) {
        const test::SweptDsi with_all = sweep(input, GetParam(), threads);
        SCOPED_TRACE(testing::Message() << nameOf(rule) << ", " << inputs.cameras << " cameras, "
                                        << inputs.groups << " groups, " << threads);
        EXPECT_EQ(alone.dsi, with_all.dsi);
        EXPECT_TRUE(test::same(alone.result.fused.peaks, with_all.result.fused.peaks));
        for (std::size_t c = 0; c < input.cameras.size(); ++c) {
          EXPECT_EQ(alone.result.votes[c].cast, with_all.result.votes[c].cast);
          EXPECT_EQ(alone.result.votes[c].outside_view, with_all.result.votes[c].outside_view);
        }
      }
    }
  }
}

}  // namespace
}  // namespace efm
