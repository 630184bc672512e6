// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/options/tracker_fault_keys.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <stdexcept>

#include "mapping/geometry/angle.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TrackerFaults faultsOf(const std::vector<std::string>& assignments) {
  TrackerFaults faults;
  for (const std::string& assignment : assignments) setTrackerFault(assignment, faults);
  return faults;
}

std::string errorOf(const std::string& assignment) {
  try {
    faultsOf({assignment});
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no error";
}

const std::vector<std::string> kAll = {"noise_m=0.01",
                                       "noise_deg=0.5",
                                       "keyframe_noise_m=2",
                                       "keyframe_noise_deg=90",
                                       "keyframe_s=0.2",
                                       "keyframe_start_s=1700000000.123456789",
                                       "drift=0.01",
                                       "drift_deg_per_m=0.5",
                                       "latency_s=0.3",
                                       "drop=0.1",
                                       "gaps_hz=2",
                                       "gap_s=0.25",
                                       "seed=7"};

TEST(TrackerFaultKeys, AreMetresDegreesAndSeconds) {
  const TrackerFaults faults = faultsOf(kAll);
  EXPECT_EQ(faults.perturbation.noise_m, 0.01);
  EXPECT_NEAR(faults.perturbation.noise_rad, 0.5 * kPi / 180, 1e-15);
  EXPECT_EQ(faults.perturbation.keyframe.noise_m, 2);
  EXPECT_NEAR(faults.perturbation.keyframe.noise_rad, kPi / 2, 1e-15);
  EXPECT_EQ(faults.perturbation.keyframe.length_ns, 200'000'000);
  EXPECT_EQ(faults.perturbation.keyframe.start_ns, 1'700'000'000'123'456'789) << "exact";
  EXPECT_EQ(faults.perturbation.drift.share, 0.01);
  EXPECT_NEAR(faults.perturbation.drift.rad_per_m, 0.5 * kPi / 180, 1e-15);
  EXPECT_EQ(faults.latency_ns, 300'000'000);
  EXPECT_EQ(faults.dropouts.drop_probability, 0.1);
  EXPECT_EQ(faults.dropouts.random_gaps_hz, 2);
  EXPECT_EQ(faults.dropouts.random_gap_s, 0.25);
  EXPECT_EQ(faults.perturbation.seed, 7U);
  EXPECT_EQ(faults.dropouts.seed, 7U);
  EXPECT_NO_THROW(faults.validate());
}

TEST(TrackerFaultKeys, AreListedWithValuesThatReadBack) {
  const auto list = listTrackerFaults(faultsOf(kAll));
  EXPECT_EQ(list.size(), kAll.size());
  TrackerFaults again;
  for (const auto& [key, value] : list) setTrackerFault(key + "=" + textOf(value), again);
  EXPECT_EQ(again.perturbation.keyframe.start_ns, 1'700'000'000'123'456'789);
  EXPECT_NEAR(again.perturbation.noise_rad, faultsOf(kAll).perturbation.noise_rad, 1e-15);
  EXPECT_EQ(again.latency_ns, 300'000'000);
  EXPECT_EQ(listTrackerFaults({}).size(), kAll.size() - 2) << "without what is not given";
}

TEST(TrackerFaultKeys, ErrorsNameKeyValueAndWhatWasExpected) {
  EXPECT_THAT(errorOf("wobble=1"),
              AllOf(HasSubstr("unknown key 'wobble'"), HasSubstr("noise_m, noise_deg")));
  EXPECT_THAT(errorOf("noise_m"), HasSubstr("'noise_m': expected key=value"));
  EXPECT_THAT(errorOf("noise_m=much"), HasSubstr("noise_m = much: must be a number, 0 to 1000"));
  EXPECT_THAT(errorOf("noise_deg=-1"), HasSubstr("noise_deg = -1: must be a number, 0 to 180"));
  EXPECT_THAT(errorOf("drop=1.5"), HasSubstr("drop = 1.5: must be a number, 0 to 1 "));
  EXPECT_THAT(errorOf("drift=nan"), HasSubstr("drift = nan"));
  EXPECT_THAT(errorOf("latency_s=11"), HasSubstr("latency_s = 11: must be a number, 0 to 10"));
  EXPECT_THAT(errorOf("keyframe_s=0"), HasSubstr("keyframe_s = 0: must be a number, 0.001"));
  EXPECT_THAT(errorOf("keyframe_start_s=soon"), HasSubstr("must be a time in seconds"));
  EXPECT_THAT(errorOf("seed=-2"), HasSubstr("seed = -2: must be a whole number from 0"));
  EXPECT_THAT(errorOf("seed=1.5"), HasSubstr("seed = 1.5: must be a whole number from 0"));
}

TEST(TrackerFaultKeys, AskForTheLengthOfKeyframesWhereTheirNoiseIs) {
  EXPECT_NO_THROW(requireKeyframeLength(faultsOf({"noise_m=1"})));
  EXPECT_NO_THROW(requireKeyframeLength(faultsOf({"keyframe_noise_m=1", "keyframe_s=1"})));
  EXPECT_THROW(requireKeyframeLength(faultsOf({"keyframe_noise_m=1"})), std::invalid_argument);
}

}  // namespace
}  // namespace efm
