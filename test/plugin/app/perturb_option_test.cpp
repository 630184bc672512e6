// SPDX-License-Identifier: BSD-3-Clause
// `--perturb` as a user gives it.

#include <opencv2/imgcodecs.hpp>

#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

using testing::HasSubstr;

class PerturbOption : public AppTest {
 protected:
  PerturbOption() { write(SyntheticRecording()); }

  cv::Mat depthOf(const std::string& name, const StampedPose& keyframe) const {
    return image(name + "/keyframes/" + formatSeconds(keyframe.t_ns) + "/depth.tiff");
  }
};

TEST_F(PerturbOption, WithZeroFaultsChangesNothing) {
  const std::string map = mapOf("data");
  EXPECT_EQ(mapOf("data --perturb noise_m=0,drop=0,seed=3", "zero"), map);
  EXPECT_FALSE(reportIn("zero").contains("perturbation"));
}

TEST_F(PerturbOption, WithLatencyOnlyMakesTheSameMap) {
  const std::string map = mapOf("data");
  for (const char* latency_s : {"0.2", "0.7"}) {
    EXPECT_EQ(mapOf(std::string("data --perturb latency_s=") + latency_s, "late"), map);
    EXPECT_EQ(contentOf("late/trajectory.txt"), contentOf("out/trajectory.txt"));
  }
}

TEST_F(PerturbOption, IsInTheReport) {
  const std::string map = mapOf("data");
  EXPECT_FALSE(reportIn("out").contains("perturbation"));
  const std::string other =
      mapOf("data --perturb noise_m=0.01,keyframe_noise_m=0.02 --perturb seed=5", "wrong");
  EXPECT_NE(other, map);
  EXPECT_EQ(mapOf("data --perturb keyframe_noise_m=0.02,noise_m=0.01,seed=5", "again"), other);
  const auto perturbation = reportIn("wrong")["perturbation"];
  EXPECT_EQ(perturbation["noise_m"], 0.01);
  EXPECT_EQ(perturbation["seed"], 5);
  EXPECT_EQ(perturbation["keyframe_s"], 0.1) << "the stride";
  EXPECT_EQ(perturbation["drop"], 0);
}

TEST_F(PerturbOption, NoiseThatIsConstantInEachWindowDoesNotChangeDepthMaps) {
  const std::string windows = "data --set keyframes.window_s=0.1 --set depth.threshold_c=30";
  mapOf(windows);
  const auto exact = posesIn("out");
  ASSERT_GE(exact.size(), 3U);
  const std::int64_t begin_ns = exact[0].t_ns - 50'000'000;
  mapOf(windows + " --perturb keyframe_noise_m=0.05,keyframe_noise_deg=2,keyframe_start_s=" +
            formatSeconds(begin_ns),
        "wrong");
  const auto wrong = posesIn("wrong");
  ASSERT_EQ(wrong.size(), exact.size());
  // The last window ends with the recording, so it has the noise of two.
  for (std::size_t k = 0; k + 1 < exact.size(); ++k) {
    const Rigid3 T_exact_wrong = exact[k].T_world_rig.inverse() * wrong[k].T_world_rig;
    EXPECT_GT(T_exact_wrong.translation.norm(), 1e-3) << k;
    EXPECT_LT(T_exact_wrong.translation.norm(), 0.05 * 4) << k;
    const cv::Mat depth = depthOf("out", exact[k]);
    const cv::Mat wrong_depth = depthOf("wrong", wrong[k]);
    ASSERT_EQ(depth.size(), wrong_depth.size());
    int points = 0;
    int others = 0;
    for (int y = 0; y < depth.rows; ++y) {
      for (int x = 0; x < depth.cols; ++x) {
        const float a = depth.at<float>(y, x);
        const float b = wrong_depth.at<float>(y, x);
        if (a == 0 && b == 0) continue;
        ++points;
        // A vote's weight is rounded to about 1e-7 of it, and poses of the packets to 1e-15 m:
        // peaks move by less than a hundredth of a plane (5 cm at 2 m). What is just at the
        // threshold may be there in one of the maps alone.
        if (a == 0 || b == 0 || std::abs(a - b) > 5e-4F) ++others;
      }
    }
    EXPECT_GT(points, 20) << k;
    EXPECT_LE(others, points / 50) << k << ": " << others << " of " << points;
  }
}

TEST_F(PerturbOption, IsWrittenToARawlogByImport) {
  const std::string perturb =
      " --perturb keyframe_noise_m=0.02,keyframe_s=0.07,noise_m=0.001,drift=0.01";
  const std::string map = mapOf("data" + perturb);
  ASSERT_EQ(run("import data --out wrong.rawlog" + perturb).status, 0);
  EXPECT_EQ(mapOf("wrong.rawlog", "from_rawlog"), map);
  // 51 poses; stretches begin at 70, 140, ..., 490 ms, at poses, of which each needs one more.
  EXPECT_THAT(run("info wrong.rawlog").out, HasSubstr("58 poses from"));
  EXPECT_THAT(run("info data --perturb latency_s=0.2").out, HasSubstr("51 poses from"));
}

}  // namespace
}  // namespace efm
