// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/scenes/scene.h"

#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <utility>

#include "mapping/base/option.h"

namespace efm {

Texture::Texture(const cv::Mat1f& log_intensity, double texel_m) {
  if (log_intensity.empty() || !(texel_m > 0)) {
    throw std::invalid_argument("a texture needs at least one texel of a size above 0");
  }
  cv::Mat1f image;
  cv::GaussianBlur(log_intensity, image, {}, 1.0, 1.0, cv::BORDER_REPLICATE);
  levels_.push_back({image, static_cast<float>(1.0 / texel_m)});
  while (std::min(image.cols, image.rows) > 3) {
    // The next level's texel and blur are twice as wide: a variance of 4 in texels of this level.
    // This level already has a variance of 1, and averaging 2x2 texels adds 1/4: 2.75 are missing.
    cv::Mat1f blurred;
    cv::GaussianBlur(image, blurred, {}, std::sqrt(2.75), std::sqrt(2.75), cv::BORDER_REPLICATE);
    // An odd last row or column gets its own texel, so that texels stay aligned.
    cv::copyMakeBorder(blurred, blurred, 0, blurred.rows % 2, 0, blurred.cols % 2,
                       cv::BORDER_REPLICATE);
    cv::Mat1f next;
    cv::resize(blurred, next, {blurred.cols / 2, blurred.rows / 2}, 0, 0, cv::INTER_AREA);
    image = next;
    levels_.push_back({image, levels_.back().texels_per_m / 2});
  }
}

float Texture::sample(double u_m, double v_m, double sigma_m) const {
  // Exponent and mantissa approximate log2 of the blur in texels. The approximation is piecewise
  // linear, continuous, and exact at the levels.
  int exponent = 0;
  const double mantissa = std::frexp(sigma_m * levels_.front().texels_per_m, &exponent);
  const int fine = exponent - 1;
  const int last = static_cast<int>(levels_.size()) - 1;
  if (fine < 0) return sampleLevel(levels_.front(), u_m, v_m);
  if (fine >= last) return sampleLevel(levels_.back(), u_m, v_m);
  const float fraction = static_cast<float>(2 * mantissa - 1);
  const auto level = levels_.begin() + fine;
  const float a = sampleLevel(*level, u_m, v_m);
  const float b = sampleLevel(*(level + 1), u_m, v_m);
  return a + fraction * (b - a);
}

float Texture::sampleLevel(const Level& level, double u_m, double v_m) {
  const int columns = level.image.cols;
  const int rows = level.image.rows;
  const float x = std::min(std::max(static_cast<float>(u_m) * level.texels_per_m - 0.5F, 0.0F),
                           static_cast<float>(columns - 1));
  const float y = std::min(std::max(static_cast<float>(v_m) * level.texels_per_m - 0.5F, 0.0F),
                           static_cast<float>(rows - 1));
  const int x0 = static_cast<int>(x);
  const int y0 = static_cast<int>(y);
  const int right = x0 + 1 < columns ? 1 : 0;
  const int below = y0 + 1 < rows ? columns : 0;
  const float* upper = reinterpret_cast<const float*>(level.image.data) +
                       static_cast<std::ptrdiff_t>(y0) * columns + x0;
  const float* lower = upper + below;
  const float fx = x - static_cast<float>(x0);
  const float fy = y - static_cast<float>(y0);
  const float top = upper[0] + fx * (upper[right] - upper[0]);
  const float bottom = lower[0] + fx * (lower[right] - lower[0]);
  return top + fy * (bottom - top);
}

int Scene::addRectangle(const Rectangle& rectangle, const Painter& paint) {
  rectangles_.push_back(rectangle);
  textures_.push_back(paint(rectangle.width_m, rectangle.height_m));
  return size() - 1;
}

void Scene::addBox(const Rigid3& T_world_box, const Eigen::Vector3d& size_m, const Painter& paint) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      // u x v points along +axis. For the opposite face, u and v are exchanged.
      int u = (axis + 1) % 3;
      int v = (axis + 2) % 3;
      if (side < 0) std::swap(u, v);
      Eigen::Vector3d corner_box = -0.5 * size_m;
      corner_box[axis] = 0.5 * side * size_m[axis];
      addRectangle({T_world_box * corner_box, T_world_box.rotation * Eigen::Vector3d::Unit(u),
                    T_world_box.rotation * Eigen::Vector3d::Unit(v), size_m[u], size_m[v]},
                   paint);
    }
  }
}

void Scene::addPole(const Pole& pole, const Painter& paint) {
  requireOption(pole.radius_m > 0, "radius_m", pole.radius_m, "above 0");
  requireOption(pole.length_m > 0, "length_m", pole.length_m, "above 0");
  constexpr int kFacets = 8;  // even, because an end joins opposite facets
  const double half_angle = kPi / kFacets;
  const double width = 2 * pole.radius_m * std::sin(half_angle);
  const double apothem = pole.radius_m * std::cos(half_angle);
  const Eigen::Quaterniond& R_world_pole = pole.T_world_pole.rotation;
  const Eigen::Vector3d along = R_world_pole * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d foot = pole.T_world_pole.translation - 0.5 * pole.length_m * along;
  for (int facet = 0; facet < kFacets; ++facet) {
    const double angle = 2 * half_angle * facet;
    const Eigen::Vector3d outward =
        R_world_pole * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
    const Eigen::Vector3d around = along.cross(outward);
    const Eigen::Vector3d edge = -0.5 * width * around;
    addRectangle({foot + apothem * outward + edge, around, along, width, pole.length_m}, paint);
    if (facet >= kFacets / 2) continue;
    const Eigen::Vector3d across = -apothem * outward + edge;
    addRectangle({foot + pole.length_m * along + across, outward, around, 2 * apothem, width},
                 paint);
    addRectangle({foot + across, around, outward, width, 2 * apothem}, paint);
  }
}

void Scene::move(const Rigid3& T_world_old) {
  for (Rectangle& r : rectangles_) {
    r.corner = T_world_old * r.corner;
    r.axis_u = T_world_old.rotation * r.axis_u;
    r.axis_v = T_world_old.rotation * r.axis_v;
  }
}

}  // namespace efm
