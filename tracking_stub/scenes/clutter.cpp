// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/scenes/clutter.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "mapping/geometry/rigid3.h"
#include "tracking_stub/random/random_numbers.h"

namespace efm {
namespace {

/// The canvas is finer than the texels by this factor. The average over a texel tells the position
/// of an edge within it.
constexpr int kOversampling = 4;

using Polygon = std::vector<cv::Point2d>;

Polygon rotatedBlock(double width, double height, double offset, double angle) {
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  Polygon polygon;
  for (const auto& [x, y] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, 1}}) {
    const double u = 0.5 * x * width;
    const double v = 0.5 * y * height + offset;
    polygon.emplace_back(c * u - s * v, s * u + c * v);
  }
  return polygon;
}

Polygon convexPolygon(int corners, double radius, RandomNumbers& random) {
  Polygon polygon;
  const double first_angle = random.uniform(0, 2 * kPi);
  for (int i = 0; i < corners; ++i) {
    const double angle = first_angle + 2 * kPi * (i + random.uniform(-0.25, 0.25)) / corners;
    polygon.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return polygon;
}

/// A shape around the origin: one polygon or three parallel bars.
std::vector<Polygon> drawShape(double size, RandomNumbers& random) {
  const double angle = random.uniform(0, kPi);
  switch (random.below(4)) {
    case 0:
      return {rotatedBlock(size, size * random.uniform(0.4, 1.0), 0, angle)};
    case 1:
      return {convexPolygon(3, 0.65 * size, random)};
    case 2:
      return {convexPolygon(5 + random.below(3), 0.55 * size, random)};
    default: {
      const double bar = size * random.uniform(0.16, 0.24);
      return {rotatedBlock(size, bar, -2 * bar, angle), rotatedBlock(size, bar, 0, angle),
              rotatedBlock(size, bar, 2 * bar, angle)};
    }
  }
}

void fill(cv::Mat1f& canvas, const Polygon& polygon, const cv::Point2d& center_px, double px_per_m,
          float value) {
  constexpr int kFractionBits = 6;
  std::vector<cv::Point> corners;
  for (const cv::Point2d& corner : polygon) {
    const cv::Point2d px = center_px + px_per_m * corner;
    corners.emplace_back(cvRound(px.x * (1 << kFractionBits)),
                         cvRound(px.y * (1 << kFractionBits)));
  }
  cv::fillConvexPoly(canvas, corners, cv::Scalar(value), cv::LINE_8, kFractionBits);
}

}  // namespace

Texture paintClutter(const ClutterOptions& options) {
  RandomNumbers random(options.seed);
  const int columns = std::max(4, static_cast<int>(std::ceil(options.width_m / options.texel_m)));
  const int rows = std::max(4, static_cast<int>(std::ceil(options.height_m / options.texel_m)));
  const double px_per_m = kOversampling / options.texel_m;
  const double ground = random.uniform(-options.ground, options.ground);
  cv::Mat1f canvas(rows * kOversampling, columns * kOversampling);
  std::fill(canvas.begin(), canvas.end(), static_cast<float>(ground));
  const double area = options.width_m * options.height_m;
  const int shapes = static_cast<int>(
      std::lround(options.coverage * area / (options.feature_m * options.feature_m)));
  for (int i = 0; i < shapes; ++i) {
    const double size = options.feature_m * random.uniform(0.6, 1.5);
    const cv::Point2d center(random.uniform(0, canvas.cols), random.uniform(0, canvas.rows));
    const double sign = random.below(2) == 0 ? -1 : 1;
    const auto value =
        static_cast<float>(ground + sign * options.contrast * random.uniform(0.45, 1.0));
    for (const Polygon& polygon : drawShape(size, random)) {
      fill(canvas, polygon, center, px_per_m, value);
    }
  }
  cv::Mat1f painting;
  cv::resize(canvas, painting, {columns, rows}, 0, 0, cv::INTER_AREA);
  return Texture(painting, options.texel_m);
}

}  // namespace efm
