// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/cloud_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "test/maps/refusals.h"

namespace efm {
namespace {

using testing::ElementsAre;

/// Points on the x axis, numbered by their confidence from 1 on.
std::vector<CloudPoint> onALine(const std::vector<double>& xs) {
  std::vector<CloudPoint> points;
  points.reserve(xs.size());
  for (const double x : xs) points.push_back({{x, 0, 0}, static_cast<float>(points.size() + 1)});
  return points;
}

std::vector<float> numbers(const std::vector<CloudPoint>& points) {
  std::vector<float> numbers;
  numbers.reserve(points.size());
  for (const CloudPoint& point : points) numbers.push_back(point.confidence);
  return numbers;
}

/// Points on a lattice of eighths of a metre, which float has exactly, in a box around `middle`.
std::vector<CloudPoint> latticePoints(std::mt19937& random, int count,
                                      const Eigen::Vector3d& middle, int radius) {
  std::uniform_int_distribution<int> eighths(-radius, radius);
  std::vector<CloudPoint> points;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d offset(eighths(random), eighths(random), eighths(random));
    points.push_back({middle + offset / 8, static_cast<float>(i + 1)});
  }
  return points;
}

std::vector<float> survivorsByBruteForce(const std::vector<CloudPoint>& points,
                                         const OutlierRemovalOptions& options) {
  std::vector<float> survivors;
  for (const CloudPoint& point : points) {
    // Itself is among those within the radius.
    const auto within = std::count_if(points.begin(), points.end(), [&](const CloudPoint& other) {
      return (other.p_world - point.p_world).norm() <= options.outlier_radius_m;
    });
    if (within - 1 >= options.outlier_min_neighbors) survivors.push_back(point.confidence);
  }
  return survivors;
}

RC_GTEST_PROP(RemoveOutliers, KeepsWhatBruteForceKeepsAtAnyDistanceFromTheOrigin, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  const auto middle = *rc::gen::element(0.0, 1e6);
  const std::vector<CloudPoint> points = latticePoints(
      random, *rc::gen::inRange(0, 400), {middle, -middle, middle}, *rc::gen::element(4, 16, 64));
  OutlierRemovalOptions options;
  options.outlier_radius_m = *rc::gen::element(0.125, 0.5, 1.0, 3.0);  // neighbours on the radius
  options.outlier_min_neighbors = *rc::gen::inRange(1, 12);

  RC_ASSERT(numbers(removeOutliers(points, options)) == survivorsByBruteForce(points, options));
}

TEST(RemoveOutliers, AFarOutlierDoesNotReduceThePrecisionOfTheOthers) {
  // From the middle of the bounds, 5e8 m away, floats would be 32 m apart.
  const std::vector<CloudPoint> points = onALine({0, 0.01, 0.02, 0.03, 0.5, 1e9});

  EXPECT_THAT(numbers(removeOutliers(points, {0.015, 1})), ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(removeOutliers(points, {}).size(), points.size()) << "radius 0";
}

TEST(RemoveOutliers, PointsThatAreNotFiniteAreRefused) {
  // The square of 1e18 is a float's, that of 1e20 is not.
  for (const double wrong : {std::nan(""), 1.0 * INFINITY, 1e18, -1e30}) {
    EXPECT_THROW(removeOutliers(onALine({0, 0, wrong}), {1, 1}), std::invalid_argument) << wrong;
  }
  EXPECT_THAT(numbers(removeOutliers(onALine({0, 0, 9.9e17}), {1, 1})), ElementsAre(1, 2));
}

TEST(OutlierRemovalOptions, ValuesOutOfRangeAreRefusedByName) {
  using Options = OutlierRemovalOptions;
  test::expectRange(&Options::outlier_radius_m, 1e-6, 1e6, "outlier_radius_m");
  test::expectRange(&Options::outlier_min_neighbors, 1, 10000, "outlier_min_neighbors");
}

}  // namespace
}  // namespace efm
