// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/depth_planes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "test/mapping/geometry/plane_position.h"

namespace efm::depth_planes_test {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(DepthPlanes, FirstAndLastPlaneAreTheRequestedLimits) {
  for (const PlaneSpacing spacing : {PlaneSpacing::kInverse, PlaneSpacing::kLinear}) {
    for (const int count : {2, 3, 100, 500}) {
      const DepthPlanes planes({0.47, 2.4, count, spacing});
      EXPECT_EQ(planes.size(), count);
      EXPECT_EQ(planes.depth(0), 0.47);
      EXPECT_EQ(planes.depth(count - 1), 2.4);
    }
  }
}

TEST(DepthPlanes, InverseSpacingIsUniformInInverseDepth) {
  const DepthPlanes planes({0.5, 4.0, 8, PlaneSpacing::kInverse});
  const double step = (1 / 0.5 - 1 / 4.0) / 7;
  EXPECT_NEAR(planes.inverseDepthStep(), step, 1e-15);
  for (int i = 1; i < planes.size(); ++i) {
    EXPECT_NEAR(1 / planes.depth(i - 1) - 1 / planes.depth(i), step, 1e-14) << i;
  }
}

TEST(DepthPlanes, LinearSpacingIsUniformInDepth) {
  const DepthPlanes planes({1.0, 3.0, 5, PlaneSpacing::kLinear});
  for (int i = 0; i < 5; ++i) EXPECT_NEAR(planes.depth(i), 1.0 + 0.5 * i, 1e-15) << i;
}

TEST(DepthPlanes, PositionsBetweenPlanesAreUniformLikeThePlanes) {
  const DepthPlanes inverse({0.5, 5.0, 100, PlaneSpacing::kInverse});
  const DepthPlanes linear({0.5, 5.0, 100, PlaneSpacing::kLinear});
  for (const double position : {0.0, 0.25, 17.5, 98.9, 99.0}) {
    EXPECT_NEAR(test::planePosition(inverse, inverse.depthAt(position)), position, 1e-10);
    EXPECT_NEAR(linear.depthAt(position), 0.5 + 4.5 * position / 99, 1e-12);
  }
}

TEST(DepthPlanes, OnePlaneLiesAtTheNearLimit) {
  const DepthPlanes planes({0.5, 5.0, 1, PlaneSpacing::kInverse});
  EXPECT_EQ(planes.size(), 1);
  EXPECT_EQ(planes.depth(0), 0.5);
  EXPECT_EQ(planes.depthAt(0), 0.5);
}

TEST(DepthPlanes, OptionsOutOfRangeAreNamed) {
  const auto make = [](double near, double far, int count) {
    return [=] { DepthPlanes({near, far, count, PlaneSpacing::kInverse}); };
  };
  EXPECT_THAT(make(0, 1, 10), ThrowsMessage<std::invalid_argument>(HasSubstr("min_depth_m = 0")));
  EXPECT_THAT(make(2, 1, 10), ThrowsMessage<std::invalid_argument>(HasSubstr("max_depth_m = 1")));
  EXPECT_THAT(make(1, 2, 0), ThrowsMessage<std::invalid_argument>(HasSubstr("num_planes = 0")));
  EXPECT_THAT(make(std::numeric_limits<double>::quiet_NaN(), 2, 9),
              ThrowsMessage<std::invalid_argument>(HasSubstr("min_depth_m = nan")));
}

TEST(DepthPlanes, StepsOfInverseSpacingAreTheSameEverywhere) {
  const DepthPlanes planes({0.5, 5.0, 100, PlaneSpacing::kInverse});
  for (const double position : {0.0, 0.2, 0.5, 41.7, 98.9, 99.0}) {
    EXPECT_NEAR(planes.inverseDepthStepAt(position), planes.inverseDepthStep(), 1e-12) << position;
  }
}

}  // namespace
}  // namespace efm::depth_planes_test
