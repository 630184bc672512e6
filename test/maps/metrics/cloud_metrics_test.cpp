// SPDX-License-Identifier: BSD-3-Clause
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "maps/metrics/cloud_metrics.h"
#include "maps/metrics/sample_statistics.h"

namespace efm {
namespace {

TEST(SampleStatistics, AreWorkedOutByHand) {
  // Sum: 10. Sum of squares: 1 + 1 + 4 + 36 = 42. Around 2.5: 1.5^2 * 2 + 0.5^2 + 3.5^2 = 17.
  const SampleStatistics statistics = statisticsOf({1, 6, 2, 1});
  EXPECT_EQ(statistics.count, 4U);
  EXPECT_DOUBLE_EQ(statistics.mean, 2.5);
  EXPECT_DOUBLE_EQ(statistics.median, 1.5);
  EXPECT_DOUBLE_EQ(statistics.rms, std::sqrt(10.5));
  EXPECT_DOUBLE_EQ(statistics.stddev, std::sqrt(17.0 / 4));
  EXPECT_EQ(statistics.min, 1);
  EXPECT_EQ(statistics.max, 6);
}

TEST(SampleStatistics, WithoutValuesAreZero) {
  EXPECT_EQ(statisticsOf({}).count, 0U);
  EXPECT_EQ(statisticsOf({}).rms, 0);
  EXPECT_EQ(quantileOf({}, 0.5), 0);
}

TEST(SampleStatistics, AQuantileIsTheSmallestValueAboveItsFraction) {
  std::vector<double> values(10);
  std::iota(values.rbegin(), values.rend(), 1.0);  // 10 … 1
  EXPECT_EQ(quantileOf(values, 0.9), 9);
  EXPECT_EQ(quantileOf(values, 0.91), 10);
  EXPECT_EQ(quantileOf(values, 1), 10);
  EXPECT_EQ(quantileOf(values, 1e-9), 1);
  EXPECT_THROW(quantileOf(values, 0), std::invalid_argument);
  EXPECT_THROW(quantileOf(values, 1.001), std::invalid_argument);
  EXPECT_EQ(medianOf({5, 1, 3}), 3);
}

using Points = std::vector<CloudPoint>;

Points pointsAt(const std::vector<Eigen::Vector3d>& positions) {
  Points points;
  for (const Eigen::Vector3d& p_world : positions) points.push_back({p_world, 1, 1});
  return points;
}

Points drawPoints() {
  const auto coordinate = rc::gen::inRange(-100, 101);
  const auto drawn = *rc::gen::nonEmpty(rc::gen::container<std::vector<std::tuple<int, int, int>>>(
      rc::gen::tuple(coordinate, coordinate, coordinate)));
  std::vector<Eigen::Vector3d> positions;
  for (const auto& [x, y, z] : drawn) positions.emplace_back(0.1 * x, 0.1 * y, 0.1 * z);
  return pointsAt(positions);
}

TEST(CloudErrors, AreWorkedOutByHand) {
  // The points are on a line: the map at 0, 1 and 5, the truth at 0, 1.5, 2 and 2.5.
  const Points map = pointsAt({{0, 0, 0}, {1, 0, 0}, {5, 0, 0}});
  const Points truth = pointsAt({{0, 0, 0}, {1.5, 0, 0}, {2, 0, 0}, {2.5, 0, 0}});

  const CloudErrors errors = cloudErrors(map, truth, {0.5, 1, 3});

  // Distances from map to truth: 0, 0.5, 2.5. From truth to map: 0, 0.5, 1, 1.5.
  EXPECT_DOUBLE_EQ(errors.accuracy.mean, 1);
  EXPECT_DOUBLE_EQ(errors.accuracy.median, 0.5);
  EXPECT_DOUBLE_EQ(errors.accuracy_p90_m, 2.5);
  EXPECT_DOUBLE_EQ(errors.completeness_distance.mean, 0.75);
  EXPECT_DOUBLE_EQ(errors.completeness_distance_p90_m, 1.5);
  ASSERT_EQ(errors.steps.size(), 3U);
  EXPECT_DOUBLE_EQ(errors.steps[0].distance_m, 0.5);
  EXPECT_DOUBLE_EQ(errors.steps[0].within, 2.0 / 3);
  EXPECT_DOUBLE_EQ(errors.steps[0].outliers, 1.0 / 3);
  EXPECT_DOUBLE_EQ(errors.steps[0].completeness, 2.0 / 4);
  EXPECT_DOUBLE_EQ(errors.steps[0].f1, 4.0 / 7);
  EXPECT_DOUBLE_EQ(errors.steps[1].completeness, 3.0 / 4);
  EXPECT_DOUBLE_EQ(errors.steps[2].outliers, 0);
  EXPECT_DOUBLE_EQ(errors.steps[2].completeness, 1);
  EXPECT_EQ(defaultCloudDistances(),
            (std::vector<double>{0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 1}));
}

TEST(CloudErrors, CompletenessMayHaveAnotherTruth) {
  const Points map = pointsAt({{0, 0, 0}, {1, 0, 0}});
  const CloudErrors errors = cloudErrors(map, pointsAt({{0, 0, 0}}), pointsAt({{1, 0, 0}}), {0.5});
  EXPECT_EQ(errors.steps[0].within, 0.5);
  EXPECT_EQ(errors.steps[0].completeness, 1);
  const Points far = pointsAt({{9, 0, 0}});
  EXPECT_EQ(cloudErrors(far, map, {0.5}).steps[0].f1, 0);
}

TEST(CloudErrors, AreExactFarFromTheOrigin) {
  const Eigen::Vector3d far(1e6, -2e6, 3e6);
  const std::vector<double> distances =
      nearestDistances(pointsAt({far}), pointsAt({far + Eigen::Vector3d(0.001, 0, 0)}));
  EXPECT_NEAR(distances.at(0), 0.001, 1e-9);
}

TEST(CloudErrors, RejectEmptyCloudsAndInvalidPoints) {
  const Points one = pointsAt({{0, 0, 0}});
  EXPECT_THROW(cloudErrors({}, one, {1}), std::invalid_argument);
  EXPECT_THROW(cloudErrors(one, {}, {1}), std::invalid_argument);
  EXPECT_THROW(cloudErrors(one, {}, one, {1}), std::invalid_argument);
  EXPECT_THROW(cloudErrors(one, one, {}, {1}), std::invalid_argument);
  EXPECT_THROW(cloudErrors(one, one, {0}), std::invalid_argument);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(cloudErrors(one, pointsAt({{0, nan, 0}}), {1}), std::invalid_argument);
  EXPECT_THROW(cloudErrors(pointsAt({{nan, 0, 0}}), one, {1}), std::invalid_argument);
}

RC_GTEST_PROP(NearestDistances, AreThoseOfBruteForce, ()) {
  const Points points = drawPoints();
  const Points others = drawPoints();
  const std::vector<double> distances = nearestDistances(points, others);
  for (std::size_t i = 0; i < points.size(); ++i) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const CloudPoint& other : others) {
      nearest = std::min(nearest, (points[i].p_world - other.p_world).norm());
    }
    RC_ASSERT(std::abs(distances[i] - nearest) < 1e-5);
  }
}

}  // namespace

}  // namespace efm
