// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/options/tracker_fault_keys.h"

#include <gmock/gmock.h>

#include "mapping/geometry/rigid3.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::HasSubstr;

TrackerFaults faultsOf(const std::vector<std::string>& assignments) {
  TrackerFaults faults;
  for (const std::string& assignment : assignments) setTrackerFault(assignment, faults);
  return faults;
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
                                       "gap_s=1e6",
                                       "tracker=poor",
                                       "depth_m=3.5",
                                       "seed=7"};

TEST(TrackerFaultKeys, AreMetresDegreesAndSeconds) {
  const TrackerFaults faults = faultsOf(kAll);
  EXPECT_EQ(faults.perturbation.noise_m, 0.01);
  EXPECT_NEAR(faults.perturbation.noise_rad, 0.5 * kRadiansPerDegree, 1e-15);
  EXPECT_EQ(faults.perturbation.keyframe.noise_m, 2);
  EXPECT_NEAR(faults.perturbation.keyframe.noise_rad, 90 * kRadiansPerDegree, 1e-15);
  EXPECT_EQ(faults.perturbation.keyframe.length_ns, 200'000'000);
  EXPECT_EQ(faults.perturbation.keyframe.start_ns, 1'700'000'000'123'456'789) << "exact";
  EXPECT_EQ(faults.perturbation.drift.fraction, 0.01);
  EXPECT_NEAR(faults.perturbation.drift.rad_per_m, 0.5 * kRadiansPerDegree, 1e-15);
  EXPECT_EQ(faults.latency_ns, 300'000'000);
  EXPECT_EQ(faults.dropouts.drop_probability, 0.1);
  EXPECT_EQ(faults.dropouts.random_gaps_hz, 2);
  EXPECT_EQ(faults.dropouts.random_gap_s, 1e6);
  EXPECT_EQ(faults.process.tracker, TrackerClass::kPoor);
  EXPECT_EQ(faults.process.depth_m, 3.5);
  EXPECT_EQ(faults.perturbation.seed, 7U);
  EXPECT_EQ(faults.dropouts.seed, 7U);
  EXPECT_NO_THROW(faults.validate());
}

TEST(TrackerFaultKeys, ATimeMayBeAsFarAsClocksGo) {
  for (const char* text : {"4611686018.427387902", "-4611686018.427387902"}) {
    EXPECT_TRUE(faultsOf({std::string("keyframe_start_s=") + text}).perturbation.keyframe.start_ns);
  }
}

TEST(TrackerFaultKeys, AreListedWithValuesThatReadBack) {
  EXPECT_EQ(listTrackerFaults(faultsOf(kAll)).size(), kAll.size());
  EXPECT_EQ(listTrackerFaults({}).size(), kAll.size() - 4) << "without what is not given";
  for (const TrackerFaults& faults : {faultsOf(kAll), TrackerFaults{}}) {
    const auto list = listTrackerFaults(faults);
    TrackerFaults again;
    for (const auto& [key, value] : list) setTrackerFault(key + "=" + textOf(value), again);
    EXPECT_EQ(listTrackerFaults(again), list);
  }
}

TEST(TrackerFaultKeys, ErrorsNameKeyValueAndWhatWasExpected) {
  const std::pair<const char*, const char*> cases[] = {
      {"wobble=1", "wobble=1: unknown key: expected one of noise_m, noise_deg"},
      {"noise_m=much", "noise_m = much: must be a number, 0 to 1000 (metres)"},
      {"drift=nan", "drift = nan: must be a number"},
      {"keyframe_start_s=soon", "must be a time in seconds"},
      {"keyframe_start_s=4611686018.427387903", "within 4.6e9 s of 0"},  // half of the largest time
      {"keyframe_start_s=-4611686018.427387903", "within 4.6e9 s of 0"},
      {"tracker=bad", "tracker = bad: must be good, typical, poor, car or none"},
      {"depth_m=0", "depth_m = 0: must be a number, 0.01 to 1e4 (metres)"},
      {"seed=-2", "seed = -2: must be a whole number from 0"},
      {"seed=1.5", "seed = 1.5: must be a whole number from 0"},
  };
  for (const auto& [assignment, error] : cases) {
    EXPECT_THAT(messageOf([text = assignment] { faultsOf({text}); }), HasSubstr(error));
  }
}

}  // namespace
}  // namespace efm
