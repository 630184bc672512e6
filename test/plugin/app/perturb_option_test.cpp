// SPDX-License-Identifier: BSD-3-Clause
// `--perturb` as a user gives it.

#include "test/plugin/app/app_test.h"

namespace efm {
namespace {

using testing::HasSubstr;

class PerturbOption : public AppTest {
 protected:
  PerturbOption() { write(SyntheticRecording()); }
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
