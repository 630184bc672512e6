// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/rendering/pixel_rays.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "test/tracking_stub/scenes/edge_scene.h"

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

TEST(PixelRays, NeedMoreThanASinglePixel) {
  CameraModel model = test::smallCamera().model;
  model.width = 1;
  EXPECT_THROW(PixelRays{model}, std::invalid_argument);
}

}  // namespace
}  // namespace efm
