// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/geometry/reference_view.h"

#include <gtest/gtest.h>

#include <cmath>

#include "test/mapping/base/refused_option.h"

namespace efm::depth_planes_test {
namespace {

TEST(DepthPlanes, AreUniformBetweenExactLimits) {
  for (const PlaneSpacing spacing : {PlaneSpacing::kInverse, PlaneSpacing::kLinear}) {
    const bool inverse = spacing == PlaneSpacing::kInverse;
    for (const int count : {1, 2, 3, 100, 500}) {
      const DepthPlanes planes({0.47, 2.4, count, spacing});
      ASSERT_EQ(planes.size(), count);
      EXPECT_EQ(planes.depth(0), 0.47);
      EXPECT_EQ(planes.depth(count - 1), count == 1 ? 0.47 : 2.4);
      const int last = std::max(1, count - 1);
      for (double position = 0; position <= count - 1; position += 0.25) {
        const double way = position / last;
        const double expected =
            inverse ? 1 / (1 / 0.47 + way * (1 / 2.4 - 1 / 0.47)) : 0.47 + way * (2.4 - 0.47);
        EXPECT_NEAR(planes.depthAt(position), expected, 1e-12) << position << " of " << count;
        if (position == std::floor(position)) {
          EXPECT_EQ(planes.depth(static_cast<int>(position)), planes.depthAt(position));
        }
      }
    }
  }
}

TEST(DepthPlanes, StepsAreDistancesOfPlanesInInverseDepth) {
  for (const int count : {2, 100}) {
    const DepthPlanes inverse({0.5, 5.0, count, PlaneSpacing::kInverse});
    const double step = (1 / 0.5 - 1 / 5.0) / (count - 1);
    EXPECT_NEAR(inverse.inverseDepthStep(), step, 1e-15);
    for (const double way : {0.0, 0.002, 0.005, 0.4, 0.999, 1.0}) {
      EXPECT_NEAR(inverse.inverseDepthStepAt(way * (count - 1)), step, 1e-12) << way;
    }
  }
  // 1, 1.5, 2, 2.5 and 3 m: half a plane to either side, as far as there are planes.
  const DepthPlanes linear({1.0, 3.0, 5, PlaneSpacing::kLinear});
  EXPECT_NEAR(linear.inverseDepthStep(), 1 - 1 / 1.5, 1e-15);
  EXPECT_NEAR(linear.inverseDepthStepAt(0), (1 - 1 / 1.25) / 0.5, 1e-12);
  EXPECT_NEAR(linear.inverseDepthStepAt(2), 1 / 1.75 - 1 / 2.25, 1e-12);
  EXPECT_NEAR(linear.inverseDepthStepAt(3.8), (1 / 2.65 - 1.0 / 3) / 0.7, 1e-12);
  const DepthPlanes one({0.5, 5.0, 1, PlaneSpacing::kInverse});
  EXPECT_EQ(one.inverseDepthStep(), 0);
  EXPECT_EQ(one.inverseDepthStepAt(0), 0);
}

TEST(DepthPlanes, OptionsHaveTheirLimits) {
  using O = DepthPlanesOptions;
  test::expectLimits<O>({{"min_depth_m", &O::min_depth_m, {0.001, 4.999}, {0, -1, 0.000999, NAN}},
                         {"max_depth_m", &O::max_depth_m, {0.501, 1e6}, {0.5, 0.001, 0, 1'000'001}},
                         {"max_depth_m", &O::max_depth_m, {}, {INFINITY, NAN}},
                         {"num_planes", &O::num_planes, {1, 100'000}, {0, 100'001}}});
  EXPECT_THROW(DepthPlanes({2, 1, 10, PlaneSpacing::kInverse}), std::invalid_argument);
}

}  // namespace
}  // namespace efm::depth_planes_test
