// SPDX-License-Identifier: BSD-3-Clause
// The fused DSI of the simulated desk, compared with the naive oracle.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "mapping/keyframes/keyframe_mapper.h"
#include "test/integration/simulated_recording.h"
#include "test/mapping/dsi/whole_dsi.h"
#include "test/oracle/naive_mapper.h"

namespace efm {
namespace {

constexpr std::int64_t kMs = 1'000'000;

/// 0.2 s of the recording, fused by the harmonic mean: by the mapper, and by the oracle with the
/// poses of the same packets and with a pose per event.
class DeskStereoDsi : public ::testing::Test {
 protected:
  struct Error {
    double l1 = 0;              ///< Of the mass.
    double same_peak = 0;       ///< Share of the pixels with votes.
    double near_peak_kept = 0;  ///< Within one plane: share of the pixels with a depth.
  };

  void SetUp() override {
    const std::int64_t t0_ns = recording().simulation().start_ns + 900 * kMs;
    options_.planes = {0.55, 5.0, 100, PlaneSpacing::kInverse};
    options_.split = SplitFusionOptions::none();
    options_.extraction.extraction = ExtractionMethod::kPaper;
    for (const StampedPose& pose : recording().poses()) trajectory_.add(pose);
    for (std::size_t c = 0; c < 2; ++c) {
      const auto in_window = [&](const Event& event) {
        return event.t_ns >= t0_ns && event.t_ns < t0_ns + 200 * kMs;
      };
      window_events_.emplace_back();
      std::copy_if(recording().events()[c].begin(), recording().events()[c].end(),
                   std::back_inserter(window_events_[c]), in_window);
    }
    KeyframeMapper mapper(recording().simulation().rig, {0, 1}, options_);
    dsi_ = std::make_unique<test::WholeDsi>(mapper.planes(), mapper.view());
    keyframe_ =
        *mapper.map({t0_ns, t0_ns + 200 * kMs, t0_ns + 100 * kMs},
                    {window_events_.begin(), window_events_.end()}, trajectory_, dsi_.get());
  }

  static const test::SimulatedRecording& recording() {
    static const test::SimulatedRecording desk = test::SimulatedRecording::desk();
    return desk;
  }

  oracle::Dsi oracleDsi(bool by_packet) const {
    const DepthPlanes planes(options_.planes);
    std::vector<oracle::Dsi> densities;
    for (std::size_t c = 0; c < 2; ++c) {
      const RigCamera& camera = recording().simulation().rig.cameras[c];
      const UndistortionTable undistortion(camera.model);
      const PacketGeometry geometry{keyframe_.T_world_ref.inverse(), keyframe_.view,
                                    planes.depth(0), planes.depth(99)};
      const auto posed =
          by_packet
              ? oracle::poseByPacket(window_events_[c],
                                     splitIntoPosePackets(window_events_[c], camera, undistortion,
                                                          trajectory_, geometry, options_.packets))
              : oracle::poseEach(window_events_[c], camera, trajectory_, keyframe_.T_world_ref);
      densities.push_back(oracle::rayDensity(posed, undistortion, keyframe_.view, planes));
    }
    return oracle::fuse(FusionRule::kHarmonic, densities);
  }

  Error compareWith(const oracle::Dsi& exact) const {
    double mass = 0;
    double difference = 0;
    oracle::Dsi ours(100, keyframe_.view);
    for (std::size_t i = 0; i < exact.values.size(); ++i) {
      ours.values[i] = dsi_->values[i];
      mass += exact.values[i];
      difference += std::abs(ours.values[i] - exact.values[i]);
    }
    const auto exact_planes = oracle::peakPlanes(exact);
    const auto exact_values = oracle::peakValues(exact);
    const auto our_planes = oracle::peakPlanes(ours);
    double with_votes = 0;
    double same = 0;
    double kept = 0;
    double near = 0;
    for (std::size_t i = 0; i < exact_planes.size(); ++i) {
      const int x = static_cast<int>(i) % keyframe_.view.width;
      const int y = static_cast<int>(i) / keyframe_.view.width;
      if (exact_values[i] > 0) {
        ++with_votes;
        same += exact_planes[i] == our_planes[i] ? 1 : 0;
      }
      if (keyframe_.map.depth(y, x) > 0) {
        ++kept;
        near += std::abs(exact_planes[i] - our_planes[i]) <= 1 ? 1 : 0;
      }
    }
    return {difference / mass, same / with_votes, near / kept};
  }

  KeyframeMapperOptions options_;
  Trajectory trajectory_;
  std::vector<std::vector<Event>> window_events_;
  KeyframeDepthMap keyframe_;
  std::unique_ptr<test::WholeDsi> dsi_;
};

TEST_F(DeskStereoDsi, TheKernelIsExactUpToItsRounding) {
  const Error error = compareWith(oracleDsi(true));
  std::cout << "kernel error: L1 " << error.l1 << " of the mass, same peak plane "
            << error.same_peak << "\n";
  // Coordinates are rounded to 1/4096 px, twice, weights to 1/1024: 3.4e-4 of the mass, a sixth of
  // what sharing poses costs. Peaks that move by it are ties of few votes.
  EXPECT_LE(error.l1, 5e-4);
  EXPECT_GE(error.same_peak, 0.98);
  EXPECT_GE(error.near_peak_kept, 0.999);
}

TEST_F(DeskStereoDsi, SharingPosesCostsNextToNothing) {
  const Error error = compareWith(oracleDsi(false));
  std::cout << "packet error: L1 " << error.l1 << " of the mass, peak within one plane on "
            << error.near_peak_kept << " of the kept pixels\n";
  EXPECT_LE(error.l1, 3e-3);
  EXPECT_GE(error.near_peak_kept, 0.995);
}

}  // namespace
}  // namespace efm
