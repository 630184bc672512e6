// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/refinement/wall_thickness.h"

#include <gtest/gtest.h>

#include "tracking_stub/random/random_numbers.h"
#include "tracking_stub/scenes/scenes.h"

namespace efm::studies {
namespace {

using Eigen::Vector3d;

/// Its walls are at x = +-3, y = +-2, z = 0 and z = 2.6. Painted once.
const Scene& testRoom() {
  static const Scene room = [] {
    RoomOptions options;
    options.size_m = {6, 4, 2.6};
    return makeRoom(options);
  }();
  return room;
}

Wall wallFacing(const std::vector<Wall>& walls, const Vector3d& normal) {
  for (const Wall& wall : walls) {
    if (wall.whole.normal().dot(normal) > 0.999) return wall;
  }
  ADD_FAILURE() << "no wall has the normal " << normal.transpose();
  return {};
}

/// Points of the wall, each off it by what `offset` says.
template <typename Offset>
std::vector<NearPoint> pointsAcross(const Wall& wall, const Offset& offset) {
  RandomNumbers random(1);
  std::vector<NearPoint> points;
  for (int i = 0; i < 20000; ++i) {
    const Vector3d on_wall = wall.whole.pointAt(random.uniform(0, wall.whole.width_m),
                                                random.uniform(0, wall.whole.height_m));
    const double offset_m = offset(random);
    points.push_back(
        {on_wall + offset_m * wall.whole.normal(), {wall.surfaces.front(), std::abs(offset_m)}});
  }
  return points;
}

TEST(WallsOf, ARoomHasSixWhateverStandsInIt) {
  const std::vector<Wall> walls = wallsOf(testRoom());
  EXPECT_EQ(walls.size(), 6U);
  const Wall floor = wallFacing(walls, Vector3d::UnitZ());
  EXPECT_NEAR(floor.whole.width_m * floor.whole.height_m, 6 * 4, 1e-9) << "of all panels";
  EXPECT_GT(floor.surfaces.size(), 1U);
}

TEST(ThicknessOf, IsTheStandardDeviationOfNormalNoise) {
  const Wall wall = wallFacing(wallsOf(testRoom()), Vector3d::UnitX());
  const WallThickness thickness =
      thicknessOf(wall, pointsAcross(wall, [](RandomNumbers& r) { return 0.02 * r.normal(); }));
  EXPECT_NEAR(thickness.thickness_m, 0.02, 0.0005);
}

TEST(ThicknessOf, LeavesOutWhatIsFarOrAtABorderOrNearestToAnotherSurface) {
  const std::vector<Wall> walls = wallsOf(testRoom());
  const Wall wall = wallFacing(walls, Vector3d::UnitX());
  const Vector3d middle = wall.whole.pointAt(0.5 * wall.whole.width_m, 0.5 * wall.whole.height_m);
  const Vector3d border = wall.whole.pointAt(0.2, 0.5 * wall.whole.height_m);
  const int surface = wall.surfaces.front();
  const int another = wallFacing(walls, Vector3d::UnitY()).surfaces.front();
  EXPECT_EQ(thicknessOf(wall, {{middle, {surface, 0}}}).points, 1U);
  EXPECT_EQ(thicknessOf(wall, {{middle, {surface, 0.31}}}).points, 0U);
  EXPECT_EQ(thicknessOf(wall, {{border, {surface, 0}}}).points, 0U);
  EXPECT_EQ(thicknessOf(wall, {{middle, {another, 0}}}).points, 0U);
}

TEST(MeanThickness, CountsEachWallByItsPoints) {
  const std::vector<Wall> walls = wallsOf(testRoom());
  auto points = pointsAcross(wallFacing(walls, Vector3d::UnitX()),
                             [](RandomNumbers& r) { return 0.01 * r.normal(); });
  const WallThickness one = meanThickness(walls, points);
  const auto others = pointsAcross(wallFacing(walls, Vector3d::UnitZ()),
                                   [](RandomNumbers& r) { return 0.03 * r.normal(); });
  points.insert(points.end(), others.begin(), others.end());
  const WallThickness both = meanThickness(walls, points);
  const double share = static_cast<double>(one.points) / static_cast<double>(both.points);
  EXPECT_NEAR(one.thickness_m, 0.01, 0.0005);
  EXPECT_NEAR(both.thickness_m, 0.01 * share + 0.03 * (1 - share), 0.001);
}

}  // namespace
}  // namespace efm::studies
