// SPDX-License-Identifier: BSD-3-Clause
#include "maps/cloud/visibility_grid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "test/maps/refusals.h"

namespace efm {
namespace {

ConsistencyOptions options() {
  ConsistencyOptions options;
  options.consistency_tolerance = 0.05;
  options.consistency_cell_deg = 1;
  return options;
}

TEST(VisibilityGrid, HiddenAndUnseenPointsAreUnknown) {
  std::vector<CloudPoint> wall;  // x and y from -1 to 1 m: every half degree and denser
  for (int y = -100; y <= 100; ++y) {
    for (int x = -100; x <= 100; ++x) wall.push_back({{0.01 * x, 0.01 * y, 2}, 1.0F});
  }
  const VisibilityGrid grid(wall, {}, options());
  EXPECT_EQ(grid.verdictOn({0.1, 0.1, 2.2}), Verdict::kUnknown) << "behind the wall";
  EXPECT_EQ(grid.verdictOn({1.2, 0, 1.5}), Verdict::kUnknown) << "outside of it";
  EXPECT_EQ(grid.verdictOn({0.1, 0.1, -2}), Verdict::kUnknown) << "behind the view";
  EXPECT_EQ(grid.verdictOn({0.1, 0.1, 0}), Verdict::kUnknown);
  EXPECT_EQ(grid.verdictOn({1e12, 0.1, 1e-9}), Verdict::kUnknown) << "far to the side";
  const auto verdict_of = [](const Eigen::Vector3d& only, const Eigen::Vector3d& asked) {
    return VisibilityGrid({{only, 1.0F}}, {}, options()).verdictOn(asked);
  };
  EXPECT_EQ(verdict_of({0, 0, 2}, {0, 0, 1}), Verdict::kUnknown) << "a single cell behind";
  EXPECT_EQ(verdict_of({0, 0, -1}, {0, 0, -1}), Verdict::kUnknown) << "a point behind the view";
  EXPECT_EQ(VisibilityGrid({}, {}, options()).verdictOn({0, 0, 1}), Verdict::kUnknown);
  // Up to 20 times its depth to the side a point is in view.
  for (const double sign : {-1.0, 1.0}) {
    for (const Eigen::Vector3d& side : {Eigen::Vector3d(sign, 0, 0), Eigen::Vector3d(0, sign, 0)}) {
      const Eigen::Vector3d inside = 19.9 * side + Eigen::Vector3d::UnitZ();
      const Eigen::Vector3d outside = 20.1 * side + Eigen::Vector3d::UnitZ();
      EXPECT_EQ(verdict_of(inside, inside), Verdict::kSupports) << side.transpose();
      EXPECT_EQ(verdict_of(outside, outside), Verdict::kUnknown) << side.transpose();
    }
  }
}

RC_GTEST_PROP(VisibilityGrid, DecidesLikeBruteForce, ()) {
  std::mt19937 random(*rc::gen::arbitrary<unsigned>());
  std::uniform_real_distribution<double> side(-0.3, 0.3);
  std::uniform_real_distribution<double> depth(1, 2);
  const auto draw = [&] {
    const double z = depth(random);
    return Eigen::Vector3d(side(random) * z, side(random) * z, z);
  };
  std::vector<CloudPoint> points;
  for (int i = 0; i < *rc::gen::inRange(1, 200); ++i) points.push_back({draw(), 1.0F});
  // Rotated by right angles and moved by whole metres.
  const Rigid3 T_world_ref{Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5), {16, -8, 4}};
  std::vector<CloudPoint> in_world = points;
  for (CloudPoint& point : in_world) point.p_world = T_world_ref * point.p_world;
  const VisibilityGrid grid(in_world, T_world_ref, options());
  int differing = 0;

  std::vector<double> inverse;
  for (const CloudPoint& point : points) inverse.push_back(1 / point.p_world.z());
  std::sort(inverse.rbegin(), inverse.rend());
  const double tolerance = 0.05 * inverse[inverse.size() / 20];
  const auto cellOf = [](const Eigen::Vector3d& p) {
    const double cell = M_PI / 180;
    return Eigen::Vector2d(std::floor(p.x() / p.z() / cell), std::floor(p.y() / p.z() / cell));
  };
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d asked = draw();
    bool supports = false;
    bool nearer = true;
    int cells = 0;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        double nearest = 0;
        double farthest = 1e9;
        for (const CloudPoint& point : points) {
          if (cellOf(point.p_world) != cellOf(asked) + Eigen::Vector2d(dx, dy)) continue;
          nearest = std::max(nearest, 1 / point.p_world.z());
          farthest = std::min(farthest, 1 / point.p_world.z());
        }
        if (nearest == 0) continue;
        ++cells;
        const double own = 1 / asked.z();
        supports = supports || std::abs(own - nearest) <= tolerance ||
                   std::abs(own - farthest) <= tolerance;
        nearer = nearer && own - nearest > 2 * tolerance;
      }
    }
    const Verdict expected = supports               ? Verdict::kSupports
                             : nearer && cells >= 2 ? Verdict::kFreeSpaceViolation
                                                    : Verdict::kUnknown;
    if (grid.verdictOn(T_world_ref * asked) != expected) ++differing;
  }
  RC_ASSERT(differing <= 1);  // rounding may move a point over a cell's border
}

TEST(ConsistencyOptions, ValuesOutOfRangeAreRefusedByName) {
  using Options = ConsistencyOptions;
  test::expectRange(&Options::consistency_tolerance, 0.001, 1, "consistency_tolerance");
  test::expectRange(&Options::consistency_cell_deg, 0.01, 10, "consistency_cell_deg");
  test::expectRange(&Options::max_contradictions, 0, 16, "max_contradictions");
  EXPECT_THAT(messageOf([] { consistencyFromName("some"); }),
              testing::HasSubstr("none, support, visibility"));
}

}  // namespace
}  // namespace efm
