// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/rendering/frame_renderer.h"

#include <gtest/gtest.h>

#include "test/tracking_stub/scenes/edge_scene.h"

namespace efm {
namespace {

TEST(DepthRendering, OfAGroundPlaneFollowsTheHyperbola) {
  Scene scene;
  // The ground 1.2 m below the camera (y = 1.2), seen from above: z = 1.2 f / (y - cy).
  scene.addRectangle({{-50, 1.2, 0}, {1, 0, 0}, {0, 0, 1}, 100, 100}, test::evenPaint(0));
  const ReferenceView view = ReferenceView::of(test::smallCamera().model);
  // From 3 m to the right and 2 m ahead, turned about the vertical.
  const Rigid3 T_world_cam{rotationBy({0, 0.3, 0}), {3, 0, 2}};
  const cv::Mat1f depth = renderDepth(scene, T_world_cam, view);
  ASSERT_EQ(depth.size(), cv::Size(64, 48));
  EXPECT_FLOAT_EQ(depth(47, 10), static_cast<float>(1.2 * 50 / (47 - 23.5)));
  EXPECT_FLOAT_EQ(depth(30, 60), static_cast<float>(1.2 * 50 / (30 - 23.5)));
  EXPECT_EQ(depth(10, 10), 0.0F);  // the sky
}

}  // namespace
}  // namespace efm
