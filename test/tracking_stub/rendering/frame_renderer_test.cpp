// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "test/tracking_stub/scenes/edge_scene.h"
#include "tracking_stub/rendering/frame_renderer.h"

namespace efm {
namespace {

TEST(PixelRays, OffsetsFromTheCentreProjectToTheSameOffsetsInTheDistortedPixel) {
  CameraModel model = test::smallCamera().model;
  model.distortion = DistortionModel::kRadtan;
  model.coefficients = {-0.3, 0.1, 0.001, -0.002};
  const PixelRays rays(model);
  for (const auto& [x, y] : {std::pair(3, 5), {32, 24}, {60, 44}}) {
    const Eigen::Vector2d pixel = model.project(rays(x, y).at(0.4, -0.3).homogeneous());
    EXPECT_NEAR(pixel.x(), x + 0.4, 0.01);
    EXPECT_NEAR(pixel.y(), y - 0.3, 0.01);
  }
}

TEST(PixelRays, HaveBoundsAroundThePixelsAreas) {
  const PixelRays rays(test::smallCamera().model);
  EXPECT_NEAR(rays.bounds().min.x(), -32.0 / 50, 1e-12);
  EXPECT_NEAR(rays.bounds().max.y(), 24.0 / 50, 1e-12);
}

TEST(PixelRays, PixelsOutsideTheLensAreDarkAndTheOthersDoNotKnowThem) {
  CameraModel model = test::smallCamera().model;
  model.distortion = DistortionModel::kRadtan;
  model.coefficients = {-0.8, 0, 0,
                        0};  // folds over at a ray of 0.645: 21.5 pixels from the centre
  const FrameRenderer renderer(model);
  Scene scene;
  scene.addRectangle(test::facingWall(1, 20, 20), test::evenPaint(1));
  Frame frame;
  renderer.render(renderer.viewFrom(scene, Rigid3()), frame);
  int dark = 0;
  for (int y = 0; y < model.height; ++y) {
    for (int x = 0; x < model.width; ++x) {
      const double distance_px = std::hypot(x - model.cx, y - model.cy);
      if (std::abs(distance_px - 21.5) < 0.1) continue;
      const bool outside = distance_px > 21.5;
      dark += outside ? 1 : 0;
      ASSERT_EQ(std::isnan(renderer.rays()(x, y).ray.x()), outside) << x << ", " << y;
      ASSERT_EQ(frame.surface(y, x), outside ? -1 : 0);
      // The wall is brighter in every pixel inside its border.
      ASSERT_EQ(frame.log_intensity(y, x), outside ? 0.0F : 1.0F) << x << ", " << y;
    }
  }
  EXPECT_GT(dark, 500);
  EXPECT_LT(renderer.rays().bounds().max.x(), 0.9);
}

TEST(PixelRays, NeedMoreThanASinglePixel) {
  CameraModel model = test::smallCamera().model;
  model.width = 1;
  EXPECT_THROW(PixelRays{model}, std::invalid_argument);
}

TEST(DepthRendering, OfAGroundPlaneFollowsTheHyperbola) {
  Scene scene;
  // The ground 1.2 m below the camera (y = 1.2), seen from above: z = 1.2 f / (y - cy).
  scene.addRectangle({{-50, 1.2, 0}, {1, 0, 0}, {0, 0, 1}, 100, 100}, test::evenPaint(0));
  const ReferenceView view = ReferenceView::of(test::smallCamera().model);
  // The camera is 3 m to the right and 2 m ahead, rotated about the vertical.
  const Rigid3 T_world_cam{rotationBy({0, 0.3, 0}), {3, 0, 2}};
  const cv::Mat1f depth = renderDepth(scene, T_world_cam, view);
  ASSERT_EQ(depth.size(), cv::Size(64, 48));
  EXPECT_FLOAT_EQ(depth(47, 10), static_cast<float>(1.2 * 50 / (47 - 23.5)));
  EXPECT_FLOAT_EQ(depth(30, 60), static_cast<float>(1.2 * 50 / (30 - 23.5)));
  EXPECT_EQ(depth(10, 10), 0.0F);  // the sky
}

}  // namespace

}  // namespace efm
