// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/truth/dataset_writer.h"

#include <gtest/gtest.h>

#include "test/tracking_stub/scenes/edge_scene.h"

namespace efm {
namespace {

TEST(SurfaceCells, ReturnTheCentresOfTheCellsWithTheMinCount) {
  Scene scene;
  scene.addRectangle({{1, 2, 3}, {1, 0, 0}, {0, 1, 0}, 0.10, 0.05}, test::evenPaint(0));
  SurfaceCells cells(scene, 0.01);
  cells.add({0, 0.001F, 0.001F});
  cells.add({0, 0.009F, 0.009F});
  cells.add({0, 0.10F, 0.05F});  // the far corner belongs to the last cell
  cells.add({});                 // no surface
  EXPECT_EQ(cells.centers(1).size(), 2U);
  const auto twice = cells.centers(2);
  ASSERT_EQ(twice.size(), 1U);
  EXPECT_LT((twice[0] - Eigen::Vector3f(1.005F, 2.005F, 3)).norm(), 1e-6F);
  EXPECT_TRUE(cells.centers(3).empty());
}

}  // namespace
}  // namespace efm
