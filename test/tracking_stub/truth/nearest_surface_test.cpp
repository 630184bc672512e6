// SPDX-License-Identifier: BSD-3-Clause
#include "test/tracking_stub/truth/nearest_surface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "test/tracking_stub/scenes/edge_scene.h"

namespace efm {
namespace {

/// A floor of 4 x 2 m, and a wall of 2 x 3 m at its end x = 4.
Scene makeCorner() {
  Scene scene;
  scene.addRectangle({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 4, 2}, test::evenPaint(0));
  scene.addRectangle({{4, 0, 0}, {0, 0, 1}, {0, 1, 0}, 3, 2}, test::evenPaint(0));
  return scene;
}

TEST(NearestSurface, HasTheNearestPoint) {
  const Scene scene = makeCorner();
  const NearestSurface floor = nearestSurface(scene, {3, 1, 0.5});
  EXPECT_EQ(floor.surface, 0);
  EXPECT_DOUBLE_EQ(floor.distance_m, 0.5);
  const NearestSurface wall = nearestSurface(scene, {3.75, 1, 0.5});
  EXPECT_EQ(wall.surface, 1);
  EXPECT_DOUBLE_EQ(wall.distance_m, 0.25);
}

TEST(NearestSurface, HasTheSameDistanceFromBehind) {
  EXPECT_DOUBLE_EQ(nearestSurface(makeCorner(), {1, 1, -0.5}).distance_m, 0.5);
}

TEST(NearestSurface, EndsAtItsBorders) {
  // 3 and 4 m from the floor's corner at the origin.
  EXPECT_DOUBLE_EQ(nearestSurface(makeCorner(), {-3, -4, 0}).distance_m, 5);
}

TEST(NearestSurface, OfAnEmptySceneIsNone) {
  const NearestSurface nearest = nearestSurface(Scene(), {0, 0, 0});
  EXPECT_EQ(nearest.surface, -1);
  EXPECT_TRUE(std::isinf(nearest.distance_m));
}

}  // namespace
}  // namespace efm
