// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/rendering/depth_rendering.h"

#include <gtest/gtest.h>

#include "mapping/geometry/timestamp.h"
#include "test/tracking_stub/scenes/edge_scene.h"
#include "tracking_stub/presets/simulation_preset.h"

namespace efm {
namespace {

TEST(DepthRendering, OfAFacingPlaneIsItsDistanceAtEveryPixel) {
  Scene scene;
  scene.addRectangle(test::facingWall(1.75, 10, 10), test::evenPaint(0));
  const ReferenceView view = ReferenceView::of(test::smallCamera().model);
  const cv::Mat1f depth = renderDepth(scene, {}, view);
  ASSERT_EQ(depth.size(), cv::Size(64, 48));
  for (const float z : depth) EXPECT_FLOAT_EQ(z, 1.75F);
}

TEST(DepthRendering, OfAGroundPlaneFollowsTheHyperbola) {
  Scene scene;
  // The ground 1.2 m below the camera (y = 1.2), seen from above: z = 1.2 f / (y - cy).
  scene.addRectangle({{-50, 1.2, 0}, {1, 0, 0}, {0, 0, 1}, 100, 100}, test::evenPaint(0));
  const ReferenceView view = ReferenceView::of(test::smallCamera().model);
  const cv::Mat1f depth = renderDepth(scene, {}, view);
  EXPECT_FLOAT_EQ(depth(47, 10), static_cast<float>(1.2 * 50 / (47 - 23.5)));
  EXPECT_FLOAT_EQ(depth(30, 60), static_cast<float>(1.2 * 50 / (30 - 23.5)));
  EXPECT_EQ(depth(10, 10), 0.0F);  // the sky
}

TEST(DepthRendering, AgreesBetweenViews) {
  const Simulation desk = makeSimulation();
  const ReferenceView view = ReferenceView::of(desk.rig.cameras[0].model);
  const Rigid3 T_world_a = desk.motion->poseAt(desk.start_ns);
  const Rigid3 T_world_b = desk.motion->poseAt(desk.start_ns + 300'000'000);
  const cv::Mat1f depth_a = renderDepth(desk.scene, T_world_a, view);
  const cv::Mat1f depth_b = renderDepth(desk.scene, T_world_b, view);
  int same = 0;
  int hidden = 0;
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      const Eigen::Vector3d p_b =
          T_world_b.inverse() * (T_world_a * view.pointAt(x, y, depth_a(y, x)));
      const Eigen::Vector2d pixel = view.project(p_b);
      const int xb = static_cast<int>(std::lround(pixel.x()));
      const int yb = static_cast<int>(std::lround(pixel.y()));
      if (xb < 0 || yb < 0 || xb >= view.width || yb >= view.height) continue;
      // The other view sees the same surface, within the rounding to a pixel, or it is hidden.
      const bool is_same = std::abs(depth_b(yb, xb) / p_b.z() - 1) < 0.02;
      (is_same ? same : hidden) += 1;
    }
  }
  EXPECT_GT(same, 70'000);
  EXPECT_LT(hidden, 0.1 * same);
}

}  // namespace
}  // namespace efm
