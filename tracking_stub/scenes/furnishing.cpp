// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/scenes/furnishing.h"

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

#include "mapping/geometry/rigid3.h"

namespace efm {

double Painting::texelFor(double nearest_m) const {
  return std::max(0.5 * nearest_m / options_.focal_px, options_.min_texel_m);
}

namespace {

int texelsAlong(double length_m, double texel_m) {
  return std::max(4, static_cast<int>(std::ceil(length_m / texel_m)));
}

}  // namespace

Scene::Painter Painting::rings(double nearest_m, double band_m, float tone, float contrast) const {
  const double texel_m = texelFor(nearest_m);
  return [texel_m, band_m, tone, contrast](double width_m, double height_m) {
    cv::Mat1f painting(texelsAlong(height_m, texel_m), texelsAlong(width_m, texel_m));
    for (int row = 0; row < painting.rows; ++row) {
      const bool second = static_cast<int>((row + 0.5) * texel_m / band_m) % 2 == 1;
      painting.row(row) = second ? tone - contrast : tone;
    }
    return Texture(painting, texel_m);
  };
}

namespace {

/// The canvas is finer than the texels by this factor. The average over a texel represents the
/// position of an edge within the texel.
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

/// Returns a shape around the origin: one polygon or three parallel bars.
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

Scene::Painter Painting::clutter(double nearest_m, double feature_m, double contrast) {
  return [this, nearest_m, feature_m, contrast](double width_m, double height_m) {
    RandomNumbers random(seed_++);
    const double texel_m = texelFor(nearest_m);
    const int columns = texelsAlong(width_m, texel_m);
    const int rows = texelsAlong(height_m, texel_m);
    const double px_per_m = kOversampling / texel_m;
    const double ground = random.uniform(-0.6, 0.6);  // surfaces differ, so silhouettes are visible
    cv::Mat1f canvas(rows * kOversampling, columns * kOversampling);
    std::fill(canvas.begin(), canvas.end(), static_cast<float>(ground));
    const double area = width_m * height_m;
    const int shapes =
        static_cast<int>(std::lround(options_.coverage * area / (feature_m * feature_m)));
    for (int i = 0; i < shapes; ++i) {
      const double size = feature_m * random.uniform(0.6, 1.5);
      const cv::Point2d center(random.uniform(0, canvas.cols), random.uniform(0, canvas.rows));
      const double sign = random.below(2) == 0 ? -1 : 1;
      const auto value = static_cast<float>(ground + sign * contrast * random.uniform(0.45, 1.0));
      for (const Polygon& polygon : drawShape(size, random)) {
        fill(canvas, polygon, center, px_per_m, value);
      }
    }
    cv::Mat1f painting;
    cv::resize(canvas, painting, {columns, rows}, 0, 0, cv::INTER_AREA);
    return Texture(painting, texel_m);
  };
}

namespace {

using Eigen::Vector3d;

/// Returns the pose of an upright object on the ground. The object's origin is in its middle.
Rigid3 standingPose(const Vector3d& foot, double height_m, double yaw_deg = 0) {
  Rigid3 T_ground_object;
  T_ground_object.rotation = Eigen::AngleAxisd(yaw_deg * kPi / 180, Vector3d::UnitZ());
  T_ground_object.translation = foot + Vector3d(0, 0, 0.5 * height_m);
  return T_ground_object;
}

/// Furnishes one wall from left to right.
class Furnisher {
 public:
  Furnisher(Scene& scene, const FurnishedWall& wall, Painting& painting, RandomNumbers& random)
      : scene_(scene), wall_(wall), painting_(painting), random_(random) {}

  void furnish() {
    double x = wall_.depth_m + 0.1;  // the corner belongs to the neighbouring wall
    while (true) {
      const double width = random_.uniform(0.55, 1.1);
      if (x + width > wall_.length_m - wall_.depth_m) return;
      const double middle = x + 0.5 * width;
      switch (random_.below(4)) {
        case 0:
          addCupboard(middle, width);
          break;
        case 1:
          addTable(middle, width);
          break;
        case 2:
          addShelf(middle, width);
          break;
        default:
          addLamp(middle);
          addPicture(middle, 0.8 * width);
      }
      x += width + random_.uniform(0.1, 0.35);
    }
  }

 private:
  void addBox(const Vector3d& foot_wall, const Vector3d& size_m, double yaw_deg, double feature_m) {
    const Rigid3 T_wall_box = standingPose(foot_wall, size_m.z(), yaw_deg);
    scene_.addBox(wall_.T_world_wall * T_wall_box, size_m,
                  painting_.clutter(wall_.nearest_m, feature_m));
  }

  void addPole(const Vector3d& foot_wall, double radius_m, double length_m) {
    const Rigid3 T_wall_pole = standingPose(foot_wall, length_m);
    const auto tone = static_cast<float>(random_.uniform(0.4, 0.9));
    scene_.addPole({wall_.T_world_wall * T_wall_pole, radius_m, length_m},
                   painting_.rings(wall_.nearest_m, 0.12, tone, 0.6F));
  }

  void addCupboard(double x, double width_m) {
    const double depth = random_.uniform(0.55, 0.75) * wall_.depth_m;
    const double height = std::min(random_.uniform(1.4, 2.0), wall_.height_m - 0.3);
    addBox({x, 0.5 * wall_.depth_m, 0}, {width_m, depth, height}, random_.uniform(-6, 6), 0.2);
  }

  void addTable(double x, double width_m) {
    const double depth = 0.9 * wall_.depth_m;
    const double height = random_.uniform(0.65, 0.8);
    const double y = 0.5 * wall_.depth_m;
    for (const double along : {-0.45, 0.45}) {
      for (const double across : {-0.45, 0.45}) {
        addPole({x + along * width_m, y + across * depth, 0}, 0.02, height);
      }
    }
    addBox({x, y, height}, {width_m, depth, 0.04}, 0, 0.16);
    addObjects({x, y, height + 0.04}, width_m);
    addPicture(x, 0.7 * width_m);
  }

  void addShelf(double x, double width_m) {
    const double depth = 0.7 * wall_.depth_m;
    const double height = random_.uniform(0.45, 1.0);
    const double y = 0.5 * wall_.depth_m;
    addBox({x, y, 0}, {width_m, depth, height}, 0, 0.18);
    addObjects({x, y, height}, width_m);
    addPicture(x, 0.7 * width_m);
  }

  /// Adds a row of small boxes.
  void addObjects(const Vector3d& middle, double width_m) {
    const int count = 2 + random_.below(2);
    for (int i = 0; i < count; ++i) {
      const double x = ((i + 0.5) / count - 0.5) * width_m;
      const Vector3d size(random_.uniform(0.1, 0.2), random_.uniform(0.08, 0.2),
                          random_.uniform(0.1, 0.35));
      addBox(middle + Vector3d(x, random_.uniform(-0.05, 0.05), 0), size, random_.uniform(-35, 35),
             0.09);
    }
  }

  void addLamp(double x) {
    const double y = 0.6 * wall_.depth_m;
    const double height = std::min(random_.uniform(1.3, 1.6), wall_.height_m - 0.6);
    addPole({x, y, 0}, 0.018, height);
    addBox({x, y, height}, {0.24, 0.24, 0.22}, random_.uniform(-40, 40), 0.1);
  }

  void addPicture(double x, double width_m) {
    const double height = std::min(random_.uniform(0.35, 0.6), 0.3 * wall_.height_m);
    const double foot = random_.uniform(0.5, 0.6) * wall_.height_m;
    addBox({x, 0.02, foot}, {width_m, 0.04, height}, 0, 0.14);
  }

  Scene& scene_;
  const FurnishedWall& wall_;
  Painting& painting_;
  RandomNumbers& random_;
};

}  // namespace

void addStandingBox(Scene& scene, const Vector3d& foot, const Vector3d& size_m, double yaw_deg,
                    const Scene::Painter& paint) {
  scene.addBox(standingPose(foot, size_m.z(), yaw_deg), size_m, paint);
}

void addStandingPole(Scene& scene, const Vector3d& foot, double radius_m, double length_m,
                     const Scene::Painter& paint) {
  scene.addPole({standingPose(foot, length_m), radius_m, length_m}, paint);
}

void addPanels(Scene& scene, const Rectangle& rectangle, double max_side_m,
               const Scene::Painter& paint) {
  const int columns = std::max(1, static_cast<int>(std::ceil(rectangle.width_m / max_side_m)));
  const int rows = std::max(1, static_cast<int>(std::ceil(rectangle.height_m / max_side_m)));
  Rectangle panel = rectangle;
  panel.width_m /= columns;
  panel.height_m /= rows;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      panel.corner = rectangle.pointAt(column * panel.width_m, row * panel.height_m);
      scene.addRectangle(panel, paint);
    }
  }
}

void furnishWall(Scene& scene, const FurnishedWall& wall, Painting& painting,
                 RandomNumbers& random) {
  Furnisher(scene, wall, painting, random).furnish();
}

}  // namespace efm
