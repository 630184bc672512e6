// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/faults/tracker_faults.h"

#include <gtest/gtest.h>

#include <map>
#include <stdexcept>

#include "test/tracking_stub/faults/pose_lists.h"

namespace efm {
namespace {

std::vector<StampedPose> withFaults(const std::vector<StampedPose>& poses,
                                    const TrackerFaults& faults) {
  return allOf(*withFaults(replay(poses), faults));
}

TrackerFaults everyFault() {
  TrackerFaults faults;
  faults.perturbation.noise_m = 0.01;
  faults.perturbation.keyframe.noise_m = 0.01;
  faults.perturbation.keyframe.length_ns = 105'000'000;
  faults.perturbation.keyframe.start_ns = 1'000'000'000;
  faults.dropouts.drop_probability = 0.2;
  faults.latency_ns = 200'000'000;
  return faults;
}

TEST(TrackerFaults, AreTheSameWhereTheSourceHasAPauseBetweenPoses) {
  const auto poses = windingWay(100);
  const auto halting = efm::withFaults(std::make_unique<HaltingSource>(poses), everyFault());
  const auto faulty = withFaults(poses, everyFault());
  EXPECT_TRUE(sameBits(polled(*halting), faulty));
  TrackerFaults other = everyFault();
  other.perturbation.seed = other.dropouts.seed = 9;
  EXPECT_FALSE(sameBits(withFaults(poses, other), faulty));
}

TEST(TrackerFaults, OfOneKindDoNotChangeOthers) {
  const auto poses = windingWay(500);
  TrackerFaults faults = everyFault();
  std::map<std::int64_t, Rigid3> all;
  for (const StampedPose& pose : withFaults(poses, faults)) all[pose.t_ns] = pose.T_world_rig;

  faults.latency_ns = 0;
  faults.dropouts = {};
  std::size_t kept = 0;
  for (const StampedPose& pose : withFaults(poses, faults)) {
    // The pose was lost, or inserted where an interval begins.
    const bool begins = (pose.t_ns - 1'000'000'000) % 105'000'000 == 0;
    if (all.count(pose.t_ns) == 0 || pose.t_ns % 10'000'000 != 0 || begins) continue;
    ++kept;
    EXPECT_LT((all[pose.t_ns].translation - pose.T_world_rig.translation).norm(), 1e-15);
  }
  EXPECT_NEAR(static_cast<double>(kept), 0.8 * 476, 50);  // binomial: the stddev is 9

  faults = {};
  faults.dropouts = everyFault().dropouts;
  for (const StampedPose& pose : withFaults(poses, faults)) EXPECT_EQ(all.count(pose.t_ns), 1U);
}

TEST(TrackerFaults, NeverLoseThePosesAtAJump) {
  TrackerFaults faults = everyFault();
  faults.dropouts.drop_probability = 0.5;
  faults.perturbation.max_pose_gap_s = 10;
  std::map<std::int64_t, Rigid3> given;
  for (const StampedPose& pose : withFaults(windingWay(500), faults)) {
    given[pose.t_ns] = pose.T_world_rig;
  }
  for (std::int64_t k = 2; k < 45; ++k) {
    const std::int64_t begin_ns = 1'000'000'000 + k * 105'000'000;
    EXPECT_EQ(given.count(begin_ns), 1U) << k;
    EXPECT_EQ(given.count(begin_ns - 1), 1U) << k;
  }
}

TEST(TrackerFaults, RefuseInvalidFaults) {
  EXPECT_THROW(efm::withFaults(nullptr, {}), std::invalid_argument);
  TrackerFaults faults;
  faults.latency_ns = -1;
  EXPECT_THROW(efm::withFaults(replay({}), faults), std::invalid_argument);
}

}  // namespace
}  // namespace efm
