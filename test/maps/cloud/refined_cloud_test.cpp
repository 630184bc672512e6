// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/refined_cloud.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

namespace efm {
namespace {

Rigid3 randomPose(std::mt19937& random, double extent_m, double extent_rad) {
  std::uniform_real_distribution<double> share(-1, 1);
  const auto draw = [&] {
    const double x = share(random);
    const double y = share(random);
    return Eigen::Vector3d(x, y, share(random));
  };
  const Eigen::Vector3d turn = extent_rad * draw();
  Rigid3 T_world_ref;
  T_world_ref.rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized());
  T_world_ref.translation = extent_m * draw();
  return T_world_ref;
}

/// Points before a view, on a surface that all views from near the origin share.
std::vector<ViewPoint> randomPoints(std::mt19937& random, std::size_t count) {
  std::uniform_real_distribution<float> share(-1, 1);
  std::vector<ViewPoint> points;
  while (points.size() < count) {
    const float x = share(random);
    const float y = share(random);
    points.push_back({{x, y, 2 + 0.2F * share(random)}, 1 + share(random) / 2});
  }
  return points;
}

GlobalCloudOptions optionsOf(Consistency consistency) {
  GlobalCloudOptions options;
  options.voxel_size_m = 0.05;
  options.consistency.consistency = consistency;
  return options;
}

bool sameBits(const std::vector<CloudPoint>& a, const std::vector<CloudPoint>& b) {
  return a.size() == b.size() &&
         std::equal(a.begin(), a.end(), b.begin(), [](const CloudPoint& p, const CloudPoint& q) {
           return p.p_world == q.p_world && p.confidence == q.confidence && p.support == q.support;
         });
}

/// What stands in a map, by and by put into another one, which then is as if nothing ever moved.
struct Placed {
  std::vector<std::vector<ViewPoint>> points;
  std::vector<Rigid3> T_world_ref;

  std::vector<CloudPoint> afresh(const GlobalCloudOptions& options) const {
    GlobalCloud cloud(options);
    for (std::size_t i = 0; i < points.size(); ++i) {
      cloud.insert(i, pointsInWorld(points[i], T_world_ref[i]), T_world_ref[i]);
    }
    return cloud.points();
  }
};

class RefinedCloudOf : public testing::TestWithParam<Consistency> {};

INSTANTIATE_TEST_SUITE_P(EachConsistency, RefinedCloudOf,
                         testing::Values(Consistency::kNone, Consistency::kSupport,
                                         Consistency::kVisibility),
                         [](const auto& at) {
                           return at.param == Consistency::kNone      ? "None"
                                  : at.param == Consistency::kSupport ? "Support"
                                                                      : "Visibility";
                         });

TEST_P(RefinedCloudOf, KeyframesThatWereMovedStandAsIfTheyHadBeenPutThere) {
  std::mt19937 random(1);
  const GlobalCloudOptions options = optionsOf(GetParam());
  RefinedCloud cloud(options, true);
  Placed placed;
  for (int i = 0; i < 12; ++i) {
    placed.points.push_back(randomPoints(random, 200));
    cloud.insert(placed.points.back(), randomPose(random, 0.2, 0.1));
    placed.T_world_ref.push_back(randomPose(random, 0.2, 0.1));
  }
  for (std::size_t i = 0; i < 12; ++i) cloud.move(i, placed.T_world_ref[i]);
  cloud.applyPending(0);
  EXPECT_TRUE(sameBits(cloud.cloud().points(), placed.afresh(options)));
}

/// Keyframes of an earlier map, new ones, motions and settlings in any order.
void checkAnyOrder(const GlobalCloudOptions& options, unsigned seed) {
  std::mt19937 random(seed);
  RefinedCloud cloud(options, true);
  Placed placed;
  const std::size_t fixed = random() % 4;
  for (std::size_t i = 0; i < fixed; ++i) {
    placed.points.push_back(randomPoints(random, random() % 80));
    placed.T_world_ref.push_back(randomPose(random, 0.2, 0.1));
    cloud.insertFixed(pointsInWorld(placed.points[i], placed.T_world_ref[i]),
                      placed.T_world_ref[i]);
  }
  std::vector<Rigid3> asked = placed.T_world_ref;
  for (int step = 0; step < 40; ++step) {
    const std::size_t count = placed.points.size() - fixed;
    const unsigned what = random() % 4;
    if (what == 0 || count == 0) {
      placed.points.push_back(randomPoints(random, random() % 80));
      placed.T_world_ref.push_back(randomPose(random, 0.2, 0.1));
      asked.push_back(placed.T_world_ref.back());
      cloud.insert(placed.points.back(), placed.T_world_ref.back());
    } else if (what < 3) {
      const std::size_t moved = random() % count;
      const double extent = std::pow(10.0, -static_cast<double>(random() % 5));
      asked[fixed + moved] = asked[fixed + moved] * randomPose(random, extent, extent);
      cloud.move(moved, asked[fixed + moved]);
    } else {
      cloud.applyPending(random() % 2 == 0 ? 0 : 0.01, random() % 6);
    }
    // The map is what it says it is, settled or not.
    for (std::size_t i = 0; i < placed.points.size() - fixed; ++i) {
      placed.T_world_ref[fixed + i] = cloud.T_world_ref()[i];
    }
    RC_ASSERT(sameBits(cloud.cloud().points(), placed.afresh(options)));
  }
  cloud.applyPending(0);
  for (std::size_t i = fixed; i < asked.size(); ++i) {
    RC_ASSERT(isSame(cloud.T_world_ref()[i - fixed], asked[i]));
  }
  placed.T_world_ref = asked;
  RC_ASSERT(sameBits(cloud.cloud().points(), placed.afresh(options)));
}

RC_GTEST_PROP(RefinedCloud, IsWhatAFreshMapOfTheSameKeyframesIs, ()) {
  checkAnyOrder(optionsOf(Consistency::kNone), *rc::gen::arbitrary<unsigned>());
}

RC_GTEST_PROP(RefinedCloud, IsWhatAFreshMapIsWhereKeyframesJudgeEachOther, ()) {
  checkAnyOrder(optionsOf(Consistency::kVisibility), *rc::gen::arbitrary<unsigned>());
}

TEST(RefinedCloud, WhatIsOffByLessThanToleratedStays) {
  std::mt19937 random(2);
  RefinedCloud cloud(optionsOf(Consistency::kNone), true);
  for (int i = 0; i < 2; ++i) cloud.insert({{{0, 0, 2}, 1}, {{0, 0, 4}, 1}}, {});
  Rigid3 T_shifted;
  T_shifted.translation = {0.003, 0, 0};
  Rigid3 T_turned;  // 4 m away: 0.004 m
  T_turned.rotation = Eigen::AngleAxisd(0.001, Eigen::Vector3d::UnitY());
  cloud.move(0, T_shifted);
  cloud.move(1, T_turned);

  cloud.applyPending(0.0045);
  EXPECT_TRUE(isSame(cloud.T_world_ref()[0], {}));
  EXPECT_TRUE(isSame(cloud.T_world_ref()[1], {}));
  cloud.applyPending(0.0035);
  EXPECT_TRUE(isSame(cloud.T_world_ref()[0], {}));
  EXPECT_TRUE(isSame(cloud.T_world_ref()[1], T_turned));
  cloud.applyPending(0.0025);
  EXPECT_TRUE(isSame(cloud.T_world_ref()[0], T_shifted));
}

TEST(RefinedCloud, WithoutToleranceTheLastDigitsCount) {
  RefinedCloud cloud(optionsOf(Consistency::kNone), true);
  std::mt19937 random(2);
  for (int i = 0; i < 200; ++i) {
    const Rigid3 T_world_ref = randomPose(random, 1, 1);
    Rigid3 T_nearest_ref = T_world_ref;
    T_nearest_ref.rotation.x() = std::nextafter(T_nearest_ref.rotation.x(), 2);
    cloud.insert({{{0, 0, 2}, 1}}, T_world_ref);
    cloud.move(cloud.T_world_ref().size() - 1, T_nearest_ref);
    cloud.applyPending(0);
    EXPECT_TRUE(isSame(cloud.T_world_ref().back(), T_nearest_ref));
  }
}

TEST(RefinedCloud, SmallMotionsAddUpUntilTheyAreNotTolerated) {
  RefinedCloud cloud(optionsOf(Consistency::kNone), true);
  cloud.insert({{{0, 0, 2}, 1}}, {});
  Rigid3 T_world_ref;
  for (int step = 1; step <= 10; ++step) {
    T_world_ref.translation.x() = 0.001 * step;
    cloud.move(0, T_world_ref);
    cloud.applyPending(0.0045);
    EXPECT_LE(std::abs(cloud.T_world_ref()[0].translation.x() - 0.001 * step), 0.0045);
  }
  EXPECT_GT(cloud.T_world_ref()[0].translation.x(), 0);
}

TEST(RefinedCloud, MovesTheOldestFirstAndNoMoreThanAsked) {
  RefinedCloud cloud(optionsOf(Consistency::kNone), true);
  Rigid3 T_world_ref;
  T_world_ref.translation = {1, 0, 0};
  for (std::size_t i = 0; i < 5; ++i) cloud.insert({{{0, 0, 2}, 1}}, {});
  for (const std::size_t i : {4U, 0U, 2U, 3U}) cloud.move(i, T_world_ref);
  const auto moved = [&] {
    std::vector<std::size_t> numbers;
    for (std::size_t i = 0; i < 5; ++i) {
      if (isSame(cloud.T_world_ref()[i], T_world_ref)) numbers.push_back(i);
    }
    return numbers;
  };
  cloud.applyPending(0.1, 0);
  EXPECT_EQ(moved(), (std::vector<std::size_t>{}));
  cloud.applyPending(0.1, 2);
  EXPECT_EQ(moved(), (std::vector<std::size_t>{0, 2}));
  cloud.applyPending(0.1, 1);
  EXPECT_EQ(moved(), (std::vector<std::size_t>{0, 2, 3}));
  cloud.applyPending(0.1);
  EXPECT_EQ(moved(), (std::vector<std::size_t>{0, 2, 3, 4}));
}

TEST(RefinedCloud, WhatCannotBeMovedStaysWhereItWas) {
  std::mt19937 random(3);
  const GlobalCloudOptions options = optionsOf(Consistency::kVisibility);
  RefinedCloud cloud(options, true);
  Placed placed;
  for (int i = 0; i < 3; ++i) {
    placed.points.push_back(randomPoints(random, 50));
    placed.T_world_ref.push_back(randomPose(random, 0.1, 0.1));
    cloud.insert(placed.points.back(), placed.T_world_ref.back());
  }
  for (const double too_far_m : {1e30, std::numeric_limits<double>::quiet_NaN()}) {
    Rigid3 T_world_ref;
    T_world_ref.translation = {too_far_m, 0, 0};
    cloud.move(1, T_world_ref);
    EXPECT_THROW(cloud.applyPending(0), std::invalid_argument);
    EXPECT_TRUE(sameBits(cloud.cloud().points(), placed.afresh(options)));
    EXPECT_NO_THROW(cloud.applyPending(0)) << "it is not tried again";
  }
  placed.T_world_ref[1] = randomPose(random, 0.1, 0.1);
  cloud.move(1, placed.T_world_ref[1]);
  cloud.applyPending(0);
  EXPECT_TRUE(sameBits(cloud.cloud().points(), placed.afresh(options)));
}

TEST(RefinedCloud, ThatNeverMovesIsAGlobalCloud) {
  std::mt19937 random(4);
  const GlobalCloudOptions options = optionsOf(Consistency::kSupport);
  RefinedCloud cloud(options, false);
  Placed placed;
  for (int i = 0; i < 4; ++i) {
    placed.points.push_back(randomPoints(random, 50));
    placed.T_world_ref.push_back(randomPose(random, 0.1, 0.1));
    cloud.insert(placed.points.back(), placed.T_world_ref.back());
  }
  cloud.applyPending(0);
  EXPECT_TRUE(sameBits(cloud.cloud().points(), placed.afresh(options)));
}

}  // namespace
}  // namespace efm
