// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/pose_source_selector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace efm {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

const PoseSourceId kMocap = {PoseKind::kPose, "mocap"};
const PoseSourceId kSlam = {PoseKind::kPose, "slam"};
const PoseSourceId kWheels = {PoseKind::kOdometry, "wheels"};
const PoseSourceId kActions = {PoseKind::kActions, "actions"};

std::vector<std::int64_t> timesOf(const std::vector<StampedPose>& poses) {
  std::vector<std::int64_t> times;
  times.reserve(poses.size());
  for (const StampedPose& pose : poses) times.push_back(pose.t_ns);
  return times;
}

TEST(PoseSourceSelector, SelectsTheFirstOfTwoSourcesOfAKind) {
  PoseSourceSelector selector("");
  EXPECT_THAT(timesOf(selector.add(kMocap, {1, {}})), ElementsAre(1)) << "at once";
  EXPECT_THAT(selector.add(kSlam, {2, {}}), IsEmpty());
  EXPECT_THAT(timesOf(selector.add(kMocap, {3, {}})), ElementsAre(3));
  EXPECT_EQ(selector.selected(), kMocap);
  EXPECT_THAT(selector.unused(), ElementsAre(Pair(kSlam, 1)));
}

TEST(PoseSourceSelector, WaitsForABetterKind) {
  PoseSourceSelector selector("");
  EXPECT_THAT(selector.add(kActions, {1, {}}), IsEmpty());
  EXPECT_THAT(selector.add(kWheels, {2, {}}), IsEmpty());
  EXPECT_THAT(timesOf(selector.add(kMocap, {3, {}})), ElementsAre(3));
  EXPECT_THAT(selector.select(), IsEmpty());
  EXPECT_THAT(selector.unused(), ElementsAre(Pair(kWheels, 1), Pair(kActions, 1)));
}

TEST(PoseSourceSelector, ReturnsTheWaitingPosesOfTheBestSourceInOrder) {
  PoseSourceSelector selector("");
  selector.add(kActions, {1, {}});
  selector.add(kWheels, {2, {}});
  selector.add(kWheels, {3, {}});
  EXPECT_THAT(timesOf(selector.select()), ElementsAre(2, 3));
  EXPECT_EQ(selector.selected(), kWheels);
  EXPECT_THAT(timesOf(selector.add(kWheels, {4, {}})), ElementsAre(4));
  EXPECT_THAT(selector.add(kMocap, {5, {}}), IsEmpty()) << "too late: a map has been begun";
  EXPECT_THAT(selector.unused(), ElementsAre(Pair(kMocap, 1), Pair(kActions, 1)));
}

TEST(PoseSourceSelector, SelectsTheNextSourceWhereNoneCameInTime) {
  PoseSourceSelector selector("");
  EXPECT_THAT(selector.select(), IsEmpty());
  EXPECT_THAT(timesOf(selector.add(kActions, {1, {}})), ElementsAre(1));
}

TEST(PoseSourceSelector, SelectsTheSourceOfALabel) {
  PoseSourceSelector selector("wheels");
  EXPECT_THAT(selector.add(kMocap, {1, {}}), IsEmpty());
  EXPECT_THAT(timesOf(selector.add(kWheels, {2, {}})), ElementsAre(2));
  EXPECT_THAT(selector.unused(), ElementsAre(Pair(kMocap, 1)));
}

TEST(PoseSourceSelector, SelectsNoSourceForAnUnknownLabel) {
  PoseSourceSelector selector("gps");
  selector.add(kMocap, {1, {}});
  EXPECT_THAT(selector.select(), IsEmpty());
  EXPECT_FALSE(selector.selected());
  EXPECT_THAT(selector.unused(), ElementsAre(Pair(kMocap, 1)));
}

}  // namespace
}  // namespace efm
