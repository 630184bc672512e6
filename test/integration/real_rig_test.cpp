// SPDX-License-Identifier: BSD-3-Clause
// Tests a real rig's calibration on its real, smoothed trajectory in a simulated room, as a user:
// simulate, map with the rig's own option file, compare with the exact truth.
#include <gmock/gmock.h>

#include <filesystem>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "mapping/geometry/reference_view.h"
#include "plugin/evaluation/depth_evaluation.h"
#include "test/plugin/program_test.h"

namespace efm {
namespace {

using RealRig = ProgramTest;

TEST_F(RealRig, MvsecsDroneMapsASimulatedRoom) {
  const std::filesystem::path data = EFM_SHARED_DATA;
  const auto trajectory = data / "trajectories" / "mvsec_indoor_flying1.txt";
  const auto calibration = data / "calibration" / "mvsec" / "camchain.yaml";
  if (!exists(trajectory) || !exists(calibration)) {
    GTEST_SKIP() << "there is no real trajectory at " << trajectory;
  }
  ASSERT_EQ(run("simulate --scene room --trajectory '" + trajectory.string() + "' --calibration '" +
                calibration.string() + "' --duration 2.1 --out room")
                .status,
            0);
  ASSERT_EQ(run("map '" EFM_SOURCE_DIR "/config/davis346_mvsec.ini' room --out out").status, 0);

  DepthEvaluationOptions options;
  options.pairing.tolerance_px = 1;
  const DepthEvaluation evaluation = evaluateDepth(folder() / "out", folder() / "room", options);
  ASSERT_EQ(evaluation.maps.size(), 2U);
  EXPECT_GT(evaluation.all.points, 4000U);
  const double step = DepthPlanes({1, 6.5, 100, PlaneSpacing::kInverse}).inverseDepthStep();
  const double error_steps = evaluation.all.median_inverse / step;
  std::cout << "median inverse depth error: " << error_steps << " plane steps of "
            << evaluation.all.points << " points\n";
  // Half of the points are within one plane step, the resolution of the planes.
  EXPECT_LE(error_steps, 1);
}

/// Tests with small real recordings of one camera, without options.
class RealRecording : public RealRig {
 protected:
  /// @return the program's output; empty if the recording is missing.
  std::string map(const std::string& name, const std::string& events,
                  const std::string& options = "") const {
    const auto data = std::filesystem::path(EFM_SHARED_DATA) / "real_small" / name;
    if (!exists(data)) return "";
    const Result result =
        run("map '" + (data / events).string() + "' --poses '" + (data / "poses.txt").string() +
            "' --calibration '" + (data / "calibration.yaml").string() + "' --out out --force " +
            options);
    EXPECT_EQ(result.status, 0);
    return result.out + result.err + result.notes;
  }
};

TEST_F(RealRecording, APanTiltHeadMapsItsDeskWithAnyNumberOfPlanes) {
  for (const char* name : {"evbench_seq2", "evbench_seq3"}) {
    for (const char* planes : {"auto", "20", "50", "100", "200"}) {
      const std::string output =
          map(name, "events.txt.gz", std::string("--set dsi.num_planes=") + planes);
      if (output.empty()) GTEST_SKIP() << "there is no recording " << name;
      // The desk and the board behind it are at 0.8 to 1.4 m.
      int depths = 0, on_the_desk = 0;
      for (const auto& entry : std::filesystem::directory_iterator(folder() / "out/keyframes")) {
        const cv::Mat1f depth =
            cv::imread((entry.path() / "depth.tiff").string(), cv::IMREAD_UNCHANGED);
        for (const float depth_m : depth) {
          depths += depth_m > 0 ? 1 : 0;
          on_the_desk += depth_m > 0.7F && depth_m < 1.6F ? 1 : 0;
        }
      }
      EXPECT_GE(depths, 300) << name << ", planes: " << planes << "\n" << output;
      EXPECT_GE(on_the_desk, 0.85 * depths) << name << ", planes: " << planes;
    }
  }
}

// One camera of 0.2 s: right clocks, too, look wrong by so little, so the clock is not named.
TEST_F(RealRecording, AMapWithAClockThatIsOffIsDoubted) {
  const std::string output = map("mvsec_indoor_flying1_24s", "events.txt");
  if (output.empty()) GTEST_SKIP() << "there is no such recording";
  EXPECT_THAT(output, testing::HasSubstr("quality     doubtful: "));
  EXPECT_THAT(output, testing::HasSubstr("could not be checked"));
  EXPECT_THAT(output, testing::HasSubstr("warning: depths-sensitive: "));
}

}  // namespace
}  // namespace efm
