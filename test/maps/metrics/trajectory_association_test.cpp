// SPDX-License-Identifier: BSD-3-Clause
#include "maps/metrics/trajectory_metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace efm {
namespace {

using testing::ElementsAre;
using testing::Pair;

/// Poses at these milliseconds; x is the time, too.
std::vector<StampedPose> posesAt(const std::vector<int>& times_ms) {
  std::vector<StampedPose> poses;
  for (const int t_ms : times_ms) {
    poses.push_back({t_ms * std::int64_t{1'000'000}, {{1, 0, 0, 0}, {1.0 * t_ms, 0, 0}}});
  }
  return poses;
}

/// The times of the paired estimates and truths.
std::vector<std::pair<double, double>> paired(const std::vector<int>& estimate_ms,
                                              const std::vector<int>& truth_ms,
                                              double max_difference_s) {
  std::vector<std::pair<double, double>> pairs;
  for (const PosePair& pair :
       associatePoses(posesAt(estimate_ms), posesAt(truth_ms), max_difference_s)) {
    EXPECT_EQ(static_cast<double>(pair.t_ns), 1e6 * pair.T_world_rig.translation.x());
    pairs.emplace_back(pair.T_map_rig.translation.x(), pair.T_world_rig.translation.x());
  }
  return pairs;
}

TEST(AssociatePoses, EachPoseOfTheShorterIsPairedWithTheNearestInTime) {
  EXPECT_THAT(paired({12, 48}, {0, 10, 20, 30, 40, 50}, 0.01),
              ElementsAre(Pair(12, 10), Pair(48, 50)));
  EXPECT_THAT(paired({0, 10, 20, 30, 40, 50}, {12, 48}, 0.01),
              ElementsAre(Pair(10, 12), Pair(50, 48)));
}

TEST(AssociatePoses, TheLimitIsIncludedAndBeyondThereIsNoPair) {
  EXPECT_THAT(paired({110, 200}, {100, 211, 300}, 0.010), ElementsAre(Pair(110, 100)));
  EXPECT_TRUE(paired({1}, {}, 1).empty());
  EXPECT_TRUE(paired({}, {}, 1).empty());
}

TEST(AssociatePoses, OfTwoAtTheSameDistanceTheEarlierIsTaken) {
  EXPECT_THAT(paired({15}, {10, 20}, 0.01), ElementsAre(Pair(15, 10)));
}

TEST(AssociatePoses, TakesPosesInAnyOrder) {
  EXPECT_THAT(paired({40, 10}, {41, 11, 77}, 0.01), ElementsAre(Pair(10, 11), Pair(40, 41)));
}

TEST(AssociatePoses, RefusesAnInvalidLimit) {
  EXPECT_THROW(associatePoses({}, {}, -1e-9), std::invalid_argument);
  EXPECT_THROW(associatePoses({}, {}, 1.001e6), std::invalid_argument);
  EXPECT_NO_THROW(associatePoses({}, {}, 1e6));
  EXPECT_THAT(paired({10}, {10}, 0), ElementsAre(Pair(10, 10)));
  EXPECT_THROW(associatePoses({}, {}, std::numeric_limits<double>::quiet_NaN()),
               std::invalid_argument);
}

}  // namespace
}  // namespace efm
