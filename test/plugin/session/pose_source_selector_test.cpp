// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/session/pose_source_selector.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace efm {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

const PoseOrigin kMocap = {PoseKind::kPose, "mocap"};
const PoseOrigin kSlam = {PoseKind::kPose, "slam"};
const PoseOrigin kWheels = {PoseKind::kOdometry, "wheels"};
const PoseOrigin kActions = {PoseKind::kActions, "actions"};

std::vector<std::int64_t> timesOf(const std::vector<StampedPose>& poses) {
  std::vector<std::int64_t> times;
  times.reserve(poses.size());
  for (const StampedPose& pose : poses) times.push_back(pose.t_ns);
  return times;
}

TEST(PoseChoice, OfTwoOfAKindTheOneThatComesFirstStands) {
  PoseChoice choice("");
  EXPECT_THAT(timesOf(choice.add(kMocap, {1, {}})), ElementsAre(1)) << "at once";
  EXPECT_THAT(choice.add(kSlam, {2, {}}), IsEmpty());
  EXPECT_THAT(timesOf(choice.add(kMocap, {3, {}})), ElementsAre(3));
  EXPECT_EQ(choice.chosen(), kMocap);
  EXPECT_THAT(choice.unused(), ElementsAre(Pair(kSlam, 1)));
}

TEST(PoseChoice, ABetterKindThatComesLaterWinsWhileItIsWaitedFor) {
  PoseChoice choice("");
  EXPECT_THAT(choice.add(kActions, {1, {}}), IsEmpty());
  EXPECT_THAT(choice.add(kWheels, {2, {}}), IsEmpty());
  EXPECT_THAT(timesOf(choice.add(kMocap, {3, {}})), ElementsAre(3));
  EXPECT_THAT(choice.settle(), IsEmpty());
  EXPECT_THAT(choice.unused(), ElementsAre(Pair(kWheels, 1), Pair(kActions, 1)));
}

TEST(PoseChoice, WhatWasHeldOfTheBestComesOutInOrderOnceNothingBetterIsWaitedFor) {
  PoseChoice choice("");
  choice.add(kActions, {1, {}});
  choice.add(kWheels, {2, {}});
  choice.add(kWheels, {3, {}});
  EXPECT_THAT(timesOf(choice.settle()), ElementsAre(2, 3));
  EXPECT_EQ(choice.chosen(), kWheels);
  EXPECT_THAT(timesOf(choice.add(kWheels, {4, {}})), ElementsAre(4));
  EXPECT_THAT(choice.add(kMocap, {5, {}}), IsEmpty()) << "too late: a map has been begun";
  EXPECT_THAT(choice.unused(), ElementsAre(Pair(kMocap, 1), Pair(kActions, 1)));
}

TEST(PoseChoice, OnceSettledWithoutAnyTheNextOneIsTaken) {
  PoseChoice choice("");
  EXPECT_THAT(choice.settle(), IsEmpty());
  EXPECT_THAT(timesOf(choice.add(kActions, {1, {}})), ElementsAre(1));
}

TEST(PoseChoice, ALabelChoosesItsSourceWhateverElseThereIs) {
  PoseChoice choice("wheels");
  EXPECT_THAT(choice.add(kMocap, {1, {}}), IsEmpty());
  EXPECT_THAT(timesOf(choice.add(kWheels, {2, {}})), ElementsAre(2));
  EXPECT_THAT(choice.unused(), ElementsAre(Pair(kMocap, 1)));
}

TEST(PoseChoice, ALabelThatNobodyHasTakesNothing) {
  PoseChoice choice("gps");
  choice.add(kMocap, {1, {}});
  EXPECT_THAT(choice.settle(), IsEmpty());
  EXPECT_FALSE(choice.chosen());
  EXPECT_THAT(choice.unused(), ElementsAre(Pair(kMocap, 1)));
}

}  // namespace
}  // namespace efm
