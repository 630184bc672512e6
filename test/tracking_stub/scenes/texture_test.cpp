// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/scenes/scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace efm {
namespace {

/// An edge at u = 1 m, from 0 to 1, on a painting of 2 m x 2 m.
Texture makeEdge(double texel_m) {
  const int texels = static_cast<int>(std::lround(2 / texel_m));
  cv::Mat1f painting(texels, texels, 0.0F);
  painting.colRange(texels / 2, texels) = 1.0F;
  return Texture(painting, texel_m);
}

double blurredStep(double distance, double sigma) {
  return 0.5 * (1 + std::erf(distance / sigma / std::sqrt(2.0)));
}

TEST(Texture, ShowsAnEdgeUnderTheRequestedBlur) {
  const Texture edge = makeEdge(0.01);
  // Whole levels of the pyramid: 1, 2, 4 and 8 texels.
  for (const double sigma : {0.01, 0.02, 0.04, 0.08}) {
    for (double distance = -3 * sigma; distance <= 3 * sigma; distance += sigma / 7) {
      EXPECT_NEAR(edge.sample(1 + distance, 1, sigma), blurredStep(distance, sigma), 0.05)
          << "sigma " << sigma << " distance " << distance;
    }
  }
}

TEST(Texture, ChangesSmoothlyWithPositionAndBlur) {
  const Texture edge = makeEdge(0.01);
  for (double u = 0.8; u < 1.2; u += 0.0005) {
    EXPECT_NEAR(edge.sample(u, 1, 0.017), edge.sample(u + 0.0005, 1, 0.017), 0.02);
  }
  for (double sigma = 0.005; sigma < 0.3; sigma *= 1.01) {
    EXPECT_NEAR(edge.sample(1.01, 1, sigma), edge.sample(1.01, 1, 1.01 * sigma), 0.01);
  }
}

TEST(Texture, RepeatsItsBorder) {
  const Texture edge = makeEdge(0.01);
  EXPECT_EQ(edge.sample(-5, -5, 0.01), 0.0F);
  EXPECT_EQ(edge.sample(50, 50, 0.01), 1.0F);
  EXPECT_NEAR(edge.sample(1, 1, 1e6), 0.5, 0.1);
}

TEST(Texture, RefusesAPaintingWithoutTexels) {
  EXPECT_THROW(Texture(cv::Mat1f(), 0.01), std::invalid_argument);
  EXPECT_THROW(Texture(cv::Mat1f(2, 2, 0.0F), 0), std::invalid_argument);
}

}  // namespace
}  // namespace efm
