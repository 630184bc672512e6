// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "test/tracking_stub/scenes/edge_scene.h"
#include "test/tracking_stub/truth/nearest_surface.h"
#include "tracking_stub/random/random_numbers.h"
#include "tracking_stub/rendering/frame_renderer.h"
#include "tracking_stub/scenes/furnishing.h"
#include "tracking_stub/scenes/scene.h"

namespace efm {
namespace {

/// Returns an edge at u = 1 m, from 0 to 1, on a texture of 2 m x 2 m.
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

TEST(Texture, RejectsAPaintingWithoutTexels) {
  EXPECT_THROW(Texture(cv::Mat1f(), 0.01), std::invalid_argument);
  EXPECT_THROW(Texture(cv::Mat1f(2, 2, 0.0F), 0), std::invalid_argument);
}

TEST(Clutter, HasEdgesOfAllOrientations) {
  PaintingOptions options;
  options.coverage = 0.5;
  const Texture texture = Painting(options).clutter(0.9, 0.1)(2, 2);
  // Sum of gradients by direction, in bins of 22.5 degrees.
  std::array<double, 8> strength{};
  constexpr double kStep = 0.004;
  for (double v = kStep; v < 2; v += kStep) {
    for (double u = kStep; u < 2; u += kStep) {
      const double here = texture.sample(u, v, 0.002);
      const double gu = texture.sample(u + kStep, v, 0.002) - here;
      const double gv = texture.sample(u, v + kStep, 0.002) - here;
      if (std::hypot(gu, gv) < 0.1) continue;
      const double half_turns = std::fmod(std::atan2(gv, gu) + M_PI, M_PI) / M_PI;
      strength[std::min<std::size_t>(7, static_cast<std::size_t>(half_turns * 8))] +=
          std::hypot(gu, gv);
    }
  }
  const auto [weakest, strongest] = std::minmax_element(strength.begin(), strength.end());
  EXPECT_GT(*weakest, 0.25 * *strongest);
}

Eigen::Vector3d randomVector(RandomNumbers& random, double size) {
  return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}

TEST(Scene, ABoxShowsItsNearestFaceFromEverySide) {
  Scene scene;
  Rigid3 T_world_box;
  T_world_box.translation = {1, 2, 3};
  scene.addBox(T_world_box, {0.2, 0.4, 0.6}, test::evenPaint(0));
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector3d away = side * Eigen::Vector3d::Unit(axis);
      const auto hit = castRay(scene, T_world_box.translation + 5 * away, -away);
      ASSERT_TRUE(hit.has_value());
      EXPECT_NEAR(hit->distance_m, 5 - 0.1 * (axis + 1), 1e-12);
    }
  }
}

TEST(Scene, APoleIsARegularPrismFromEverySide) {
  Scene scene;
  Rigid3 T_world_pole;
  T_world_pole.translation = {1, 2, 3};
  T_world_pole.rotation = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized());
  scene.addPole({T_world_pole, 0.1, 2}, test::evenPaint(0));
  RandomNumbers random(3);
  const double apothem = 0.1 * std::cos(M_PI / 8);
  for (int i = 0; i < 500; ++i) {
    // A horizontal ray towards the axis meets the side between the apothem and the corner.
    const double angle = random.uniform(0, 2 * M_PI);
    const Eigen::Vector3d out_pole(std::cos(angle), std::sin(angle), 0);
    const Eigen::Vector3d on_axis_pole(0, 0, random.uniform(-0.999, 0.999));
    const Eigen::Vector3d out_world = T_world_pole.rotation * out_pole;
    const auto side = castRay(scene, T_world_pole * on_axis_pole + 5 * out_world, -out_world);
    ASSERT_TRUE(side.has_value());
    EXPECT_GE(5 - side->distance_m, apothem - 1e-9);
    EXPECT_LE(5 - side->distance_m, 0.1 + 1e-9);
    // A ray along the axis meets the end everywhere inside the polygon.
    const Eigen::Vector3d inside_pole = random.uniform(0, 0.999 * apothem) * out_pole;
    const double end = random.below(2) == 0 ? -1 : 1;
    const Eigen::Vector3d along_world = T_world_pole.rotation * Eigen::Vector3d(0, 0, end);
    const auto cap = castRay(scene, T_world_pole * inside_pole + 5 * along_world, -along_world);
    ASSERT_TRUE(cap.has_value());
    EXPECT_NEAR(cap->distance_m, 4, 1e-9);
  }
}

TEST(Scene, RejectsAnInvalidPole) {
  Scene scene;
  EXPECT_THROW(scene.addPole({{}, 0, 1}, test::evenPaint(0)), std::invalid_argument);
  EXPECT_THROW(scene.addPole({{}, 0.1, 0}, test::evenPaint(0)), std::invalid_argument);
}

TEST(Scene, MovesAllSurfaces) {
  Scene scene;
  scene.addRectangle(test::facingWall(2, 1, 1), test::evenPaint(0));
  Rigid3 T_world_old;
  T_world_old.rotation = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY());  // z becomes x
  T_world_old.translation = {0, 0.3, 0};
  scene.move(T_world_old);
  const auto hit = castRay(scene, {0, 0.3, 0}, {1, 0, 0});
  ASSERT_TRUE(hit.has_value());
  EXPECT_NEAR(hit->distance_m, 2, 1e-12);
  EXPECT_NEAR(hit->point.u_m, 0.5, 1e-6);
}

TEST(SceneView, FindsTheHitsOfThePlainRayCast) {
  RandomNumbers random(7);
  int hits = 0;
  for (int trial = 0; trial < 20; ++trial) {
    Scene scene;
    for (int i = 0; i < 30; ++i) {
      Rigid3 T_world_box;
      T_world_box.translation = randomVector(random, 2);
      T_world_box.rotation =
          Eigen::AngleAxisd(random.uniform(0, 3), randomVector(random, 1).normalized());
      scene.addBox(T_world_box, Eigen::Vector3d(0.4, 0.4, 0.4) + randomVector(random, 0.3),
                   test::evenPaint(0));
    }
    Rigid3 T_world_cam;
    T_world_cam.translation = randomVector(random, 1);
    T_world_cam.rotation =
        Eigen::AngleAxisd(random.uniform(0, 3), randomVector(random, 1).normalized());
    const SceneView view(scene, T_world_cam, {{-0.8, -0.6}, {0.8, 0.6}});
    for (int i = 0; i < 2000; ++i) {
      // Some rays are outside of the bounds.
      const Eigen::Vector2d ray(random.uniform(-1, 1), random.uniform(-1, 1));
      const Eigen::Vector3d direction_cam = ray.homogeneous();
      const auto plain =
          castRay(scene, T_world_cam.translation, T_world_cam.rotation * direction_cam);
      const ViewHit fast = view.cast(ray);
      ASSERT_EQ(fast.surface, plain ? plain->point.surface : -1) << ray.transpose();
      if (!plain) continue;
      ++hits;
      EXPECT_NEAR(direction_cam.norm() / fast.inverse_depth, plain->distance_m, 1e-9);
      const SurfacePoint point = view.surfacePointOf(fast, ray);
      EXPECT_NEAR(point.u_m, plain->point.u_m, 1e-5);
      EXPECT_NEAR(point.v_m, plain->point.v_m, 1e-5);
    }
  }
  EXPECT_GT(hits, 2000);
}

}  // namespace

}  // namespace efm
