// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>

#include <cmath>

#include "maps/metrics/trajectory_metrics.h"

namespace efm {
namespace {

using testing::ElementsAre;
using testing::Pair;

/// Returns poses at the times; x is the time in milliseconds, too.
std::vector<StampedPose> posesAt(const std::vector<int>& times_ms) {
  std::vector<StampedPose> poses;
  for (const int t_ms : times_ms) {
    poses.push_back({t_ms * std::int64_t{1'000'000}, {{1, 0, 0, 0}, {1.0 * t_ms, 0, 0}}});
  }
  return poses;
}

/// Returns the times of the paired estimates and truths.
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

TEST(AssociatePoses, EachPoseOfTheShorterIsPairedWithTheNearestInTimeUpToTheLimit) {
  EXPECT_THAT(paired({12, 48}, {0, 10, 20, 30, 40, 50}, 0.01),
              ElementsAre(Pair(12, 10), Pair(48, 50)));
  EXPECT_THAT(paired({0, 10, 20, 30, 40, 50}, {12, 48}, 0.01),
              ElementsAre(Pair(10, 12), Pair(50, 48)));
  EXPECT_THAT(paired({110, 200}, {100, 211, 300}, 0.010), ElementsAre(Pair(110, 100)));
  EXPECT_THAT(paired({15}, {10, 20}, 0.01), ElementsAre(Pair(15, 10))) << "of two the earlier";
  EXPECT_THAT(paired({40, 10}, {41, 11, 77}, 0.01), ElementsAre(Pair(10, 11), Pair(40, 41)))
      << "in any order";
  EXPECT_TRUE(paired({1}, {}, 1).empty());
  EXPECT_TRUE(paired({}, {}, 1).empty());
}

TEST(AssociatePoses, RejectsAnInvalidLimit) {
  EXPECT_THROW(associatePoses({}, {}, -1e-9), std::invalid_argument);
  EXPECT_THROW(associatePoses({}, {}, 1.001e6), std::invalid_argument);
  EXPECT_NO_THROW(associatePoses({}, {}, 1e6));
  EXPECT_THAT(paired({10}, {10}, 0), ElementsAre(Pair(10, 10)));
  EXPECT_THROW(associatePoses({}, {}, std::numeric_limits<double>::quiet_NaN()),
               std::invalid_argument);
}

using testing::DoubleNear;
using Unit = RelativeSpacing::Unit;

Rigid3 at(double x, double y = 0, double z = 0, double yaw_rad = 0) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ())), {x, y, z}};
}

PosePair pair(double t_s, const Rigid3& T_map_rig, const Rigid3& T_world_rig) {
  return {static_cast<std::int64_t>(std::llround(t_s * 1e9)), T_map_rig, T_world_rig};
}

void expectNear(const std::vector<double>& a, const std::vector<double>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-9) << i;
}

TEST(AbsoluteErrors, AreWorkedOutByHand) {
  const std::vector<PosePair> pairs = {pair(0, at(0, 0, 0), at(0, 3, 4)),
                                       pair(1, at(1, 0, 0, 0.25), at(1, 0, 0))};
  const PoseErrors errors = absoluteErrors(pairs, {});
  EXPECT_THAT(errors.translation_m, ElementsAre(DoubleNear(5, 1e-15), 0));
  EXPECT_THAT(errors.rotation_rad, ElementsAre(0, DoubleNear(0.25, 1e-15)));
  EXPECT_DOUBLE_EQ(statisticsOf(errors.translation_m).rms, 5 / std::sqrt(2.0));
}

TEST(AbsoluteErrors, AlignmentOfThreePointsIsWorkedOutByHand) {
  // The estimate is the truth, rotated by 90 deg and moved.
  const Rigid3 T_map_world = at(5, 6, 7, M_PI / 2);
  std::vector<PosePair> pairs;
  for (const Rigid3& T_world_rig : {at(0, 0), at(2, 0), at(0, 1)}) {
    pairs.push_back(pair(pairs.size(), T_map_world * T_world_rig, T_world_rig));
  }
  const Rigid3 T_world_map = alignTrajectories(pairs, TrajectoryAlignment::kSe3);
  const Rigid3 expected = T_map_world.inverse();
  EXPECT_LT((T_world_map.translation - expected.translation).norm(), 1e-12);
  EXPECT_LT(T_world_map.rotation.angularDistance(expected.rotation), 1e-12);
}

TEST(AbsoluteErrors, AlignmentNeverScales) {
  // The estimate is twice as large: corners are off by their distances from the middle.
  std::vector<PosePair> pairs;
  for (const auto& [x, y] : {std::pair{1, 1}, {-1, 1}, {-1, -1}, {1, -1}}) {
    pairs.push_back(pair(pairs.size(), at(2 * x, 2 * y), at(x, y)));
  }
  const Rigid3 T_world_map = alignTrajectories(pairs, TrajectoryAlignment::kSe3);
  for (const double error_m : absoluteErrors(pairs, T_world_map).translation_m) {
    EXPECT_NEAR(error_m, std::sqrt(2.0), 1e-12);
  }
}

TEST(AbsoluteErrors, AlignmentAtTheOriginMakesTheFirstPosesCoincide) {
  const std::vector<PosePair> pairs = {pair(0, at(1, 2, 3, 1), at(0, 0, 0, 0.5)),
                                       pair(1, at(1, 2, 3, 1) * at(1), at(0, 0, 0, 0.5) * at(2))};
  const PoseErrors errors =
      absoluteErrors(pairs, alignTrajectories(pairs, TrajectoryAlignment::kOrigin));
  EXPECT_THAT(errors.translation_m, ElementsAre(DoubleNear(0, 1e-12), DoubleNear(1, 1e-12)));
}

TEST(AbsoluteErrors, TooFewPairsOrPositionsOnALineAreRejected) {
  const auto along = [](double gradient) {
    std::vector<PosePair> pairs;
    for (int i = 0; i < 5; ++i)
      pairs.push_back(pair(i, at(i, i * i), at(i, gradient * i, 0.1 * i)));
    return pairs;
  };
  EXPECT_THROW(alignTrajectories(along(3), TrajectoryAlignment::kSe3), std::invalid_argument);
  EXPECT_THROW(alignTrajectories({}, TrajectoryAlignment::kNone), std::invalid_argument);
  std::vector<PosePair> swapped = along(3);  // only the estimate is a line
  for (PosePair& one : swapped) std::swap(one.T_map_rig, one.T_world_rig);
  EXPECT_THROW(alignTrajectories(swapped, TrajectoryAlignment::kSe3), std::invalid_argument);
  EXPECT_EQ(alignTrajectories(swapped, TrajectoryAlignment::kNone).translation.norm(), 0);
  EXPECT_THROW(
      alignTrajectories({pair(0, at(0), at(0)), pair(1, at(1), at(1))}, TrajectoryAlignment::kSe3),
      std::invalid_argument);
}

TEST(RelativeErrors, AreWorkedOutByHand) {
  // The truth moves at 1 m/s, the estimate at 1.1 m/s with a turn by 0.1 rad in its second step.
  std::vector<PosePair> pairs;
  Rigid3 T_map_rig;
  for (int i = 0; i < 4; ++i) {
    pairs.push_back(pair(i, T_map_rig, at(i)));
    T_map_rig = T_map_rig * at(1.1, 0, 0, i == 1 ? 0.1 : 0);
  }
  const PoseErrors steps = relativeErrors(pairs, {Unit::kFrames, 1});
  EXPECT_THAT(steps.translation_m,
              ElementsAre(DoubleNear(0.1, 1e-12), DoubleNear(0.1, 1e-12), DoubleNear(0.1, 1e-12)));
  EXPECT_THAT(steps.rotation_rad,
              ElementsAre(DoubleNear(0, 1e-12), DoubleNear(0.1, 1e-12), DoubleNear(0, 1e-12)));

  const PoseErrors two = relativeErrors(pairs, {Unit::kFrames, 2});
  EXPECT_THAT(two.translation_m,
              ElementsAre(DoubleNear(0.2, 1e-12),
                          DoubleNear(std::hypot(1.1 + 1.1 * std::cos(0.1) - 2, 1.1 * std::sin(0.1)),
                                     1e-12)));
  expectNear(relativeErrors(pairs, {Unit::kMetres, 2}).translation_m, two.translation_m);
  expectNear(relativeErrors(pairs, {Unit::kSeconds, 2}).translation_m, two.translation_m);
}

TEST(RelativeErrors, TakeTheNearestOtherEndWithinAFifth) {
  std::vector<PosePair> pairs;
  for (const double x : {0.0, 0.9, 1.15, 2.0, 2.0, 3.5}) pairs.push_back(pair(x, at(x), at(x)));
  // Ends: 0.9 for 0, the first 2.0 for 0.9, 2.0 for 1.15, none for both 2.0 (no pose near 3).
  EXPECT_EQ(relativeErrors(pairs, {Unit::kMetres, 1}).translation_m.size(), 3U);
  EXPECT_EQ(relativeErrors(pairs, {Unit::kSeconds, 1}).translation_m.size(), 3U);
  EXPECT_DOUBLE_EQ(trueLength(pairs), 3.5);
  EXPECT_EQ(trueLength({}), 0);
  // Ends are just inside the (excluded) limits. Of two equally near ends the earlier is used.
  const auto errorsOver = [](const std::vector<double>& xs) {
    std::vector<PosePair> moved;
    for (const double x : xs) moved.push_back(pair(x, at(1.5 * x), at(x)));
    return relativeErrors(moved, {Unit::kMetres, 5}).translation_m;
  };
  EXPECT_THAT(errorsOver({0, 4.25}), ElementsAre(0.5 * 4.25));
  EXPECT_THAT(errorsOver({0, 5.75}), ElementsAre(0.5 * 5.75));
  EXPECT_TRUE(errorsOver({0, 4}).empty());
  EXPECT_TRUE(errorsOver({0, 6}).empty());
  EXPECT_THAT(errorsOver({0, 4.5, 5.5}), ElementsAre(0.5 * 4.5));
}

TEST(RelativeErrors, OfATooShortTrajectoryAreNone) {
  const std::vector<PosePair> pairs = {pair(0, at(0), at(0)), pair(1, at(1), at(1))};
  for (const Unit unit : {Unit::kFrames, Unit::kMetres, Unit::kSeconds}) {
    EXPECT_TRUE(relativeErrors(pairs, {unit, 10}).translation_m.empty());
    EXPECT_TRUE(relativeErrors({}, {unit, 1}).translation_m.empty());
  }
  EXPECT_THROW(relativeErrors(pairs, {Unit::kFrames, 0.5}), std::invalid_argument);
  EXPECT_THROW(relativeErrors(pairs, {Unit::kMetres, 0}), std::invalid_argument);
  EXPECT_THROW(relativeErrors(pairs, {Unit::kSeconds, INFINITY}), std::invalid_argument);
}

}  // namespace

}  // namespace efm
