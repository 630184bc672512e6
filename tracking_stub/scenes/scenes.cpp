// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/scenes/scenes.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "mapping/base/option.h"
#include "mapping/geometry/rigid3.h"
#include "tracking_stub/random/random_numbers.h"
#include "tracking_stub/scenes/furnishing.h"

namespace efm {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kRoomPanelM = 1.7;

/// Returns one of the four walls. The wall's origin is at its left end, seen from inside.
FurnishedWall wallOf(const RoomOptions& options, int side) {
  const bool along_x = side % 2 == 0;
  const double length = along_x ? options.size_m.x() : options.size_m.y();
  const double distance = 0.5 * (along_x ? options.size_m.y() : options.size_m.x());
  // Wall 0 is at y = -width/2. Its axes are the axes of the room.
  const Eigen::Quaterniond R_world_wall(Eigen::AngleAxisd(0.5 * kPi * side, Vector3d::UnitZ()));
  FurnishedWall wall;
  wall.T_world_wall.rotation = R_world_wall;
  wall.T_world_wall.translation = R_world_wall * Vector3d(-0.5 * length, -distance, 0);
  wall.length_m = length;
  wall.height_m = options.size_m.z();
  wall.depth_m = options.furniture_depth_m;
  wall.nearest_m = options.nearest_m;
  return wall;
}

void addFloorAndCeiling(Scene& scene, const RoomOptions& options, Painting& painting) {
  const Vector3d x = Vector3d::UnitX();
  const Vector3d y = Vector3d::UnitY();
  const Vector3d half = 0.5 * options.size_m;
  addPanels(scene, {{-half.x(), -half.y(), 0}, x, y, 2 * half.x(), 2 * half.y()}, kRoomPanelM,
            painting.clutter(options.nearest_m, 0.24));
  addPanels(scene, {{-half.x(), -half.y(), 2 * half.z()}, y, x, 2 * half.y(), 2 * half.x()},
            kRoomPanelM, painting.clutter(options.nearest_m, 0.36));
}

constexpr double kBehindM = 6;  // from the start of the street to the path
constexpr double kAheadM = 25;  // minimum from the path to the house at the end
constexpr double kStreetPanelM = 5;
constexpr double kClearanceM = 3;  // from the path to the nearest object
constexpr double kFacadeM = 7;     // from the middle of the road to the houses
constexpr double kNearestM = 4;

/// The path with straight extensions at both ends. A position on the line is the length up to it.
class MiddleLine {
 public:
  explicit MiddleLine(const StreetOptions& options) {
    for (const Vector2d& point : options.path) {
      if (points_.empty() || (point - points_.back()).norm() > 0.25) points_.push_back(point);
    }
    requireOption(points_.size() >= 2, "path", points_.size(),
                  "of at least two points a quarter of a metre apart");
    path_points_ = points_;
    const std::size_t last = points_.size() - 1;
    const std::size_t before = last > 8 ? last - 8 : 0;  // for the direction of the last steps
    const Vector2d first_step = (points_[std::min<std::size_t>(8, last)] - points_[0]).normalized();
    const Vector2d last_step = (points_[last] - points_[before]).normalized();
    double path_length = 0;
    for (std::size_t i = 1; i < points_.size(); ++i)
      path_length += (points_[i] - points_[i - 1]).norm();
    points_.push_back(points_.back() +
                      std::max(kAheadM, options.min_length_m - path_length) * last_step);
    points_.insert(points_.begin(), points_.front() - kBehindM * first_step);
    for (std::size_t i = 1; i < points_.size(); ++i) {
      length_ += (points_[i] - points_[i - 1]).norm();
    }
  }

  double length() const { return length_; }
  const std::vector<Vector2d>& points() const { return points_; }

  struct Station {
    Vector2d point;
    Vector2d ahead;  // unit vector
    Vector2d leftBy(double left_m) const {
      return point + left_m * Vector2d(-ahead.y(), ahead.x());
    }
    double yawDegrees() const { return std::atan2(ahead.y(), ahead.x()) * 180 / kPi; }
  };
  Station at(double s_m) const {
    for (std::size_t i = 1; i < points_.size(); ++i) {
      const Vector2d step = points_[i] - points_[i - 1];
      if (s_m <= step.norm() || i + 1 == points_.size()) {
        return {points_[i - 1] + s_m * step.normalized(), step.normalized()};
      }
      s_m -= step.norm();
    }
    return {points_.front(), Vector2d::UnitX()};
  }

  /// Returns the distance to the path without its extensions.
  double distanceToPath(const Vector2d& point) const {
    double nearest = (point - path_points_.front()).norm();
    for (const Vector2d& path_point : path_points_) {
      nearest = std::min(nearest, (point - path_point).norm());
    }
    return nearest;
  }

 private:
  std::vector<Vector2d> points_;
  std::vector<Vector2d> path_points_;
  double length_ = 0;
};

class StreetBuilder {
 public:
  StreetBuilder(const StreetOptions& options)
      : line_(options), painting_(paintingOptions(options)), random_(options.seed, 1) {}

  Scene build() {
    addRoad();
    for (const double side : {-1.0, 1.0}) {
      addHouses(side);
      addRoadside(side);
    }
    addHouse(line_.at(line_.length()), 0, {6, 34, 13});
    return std::move(scene_);
  }

 private:
  static PaintingOptions paintingOptions(const StreetOptions& options) {
    PaintingOptions painting;
    painting.seed = options.seed;
    painting.focal_px = options.focal_px;
    painting.min_texel_m = 0.01;
    return painting;
  }

  void addRoad() {
    Eigen::AlignedBox2d box;
    for (const Vector2d& point : line_.points()) box.extend(point);
    const double margin = kFacadeM + 1.5;
    const Vector2d size = box.sizes() + Vector2d::Constant(2 * margin);
    const Vector2d corner = box.min() - Vector2d::Constant(margin);
    addPanels(
        scene_,
        {{corner.x(), corner.y(), 0}, Vector3d::UnitX(), Vector3d::UnitY(), size.x(), size.y()},
        kStreetPanelM, painting_.clutter(kNearestM, 0.9, 0.7));
  }

  bool isFree(const Vector2d& middle, double radius_m) const {
    return line_.distanceToPath(middle) > radius_m + kClearanceM;
  }

  /// Adds three sides of a house: the roof and the other side are never visible.
  void addHouse(const MiddleLine::Station& station, double left_m, const Vector3d& size_m) {
    const double side = left_m == 0 ? 0 : (left_m > 0 ? 1 : -1);
    const Vector2d across(-station.ahead.y(), station.ahead.x());
    // `along` x up is `front`: the normal points out of the house.
    const Vector2d inwards = left_m == 0 ? station.ahead : Vector2d(side * across);
    const Vector3d front(-inwards.x(), -inwards.y(), 0);
    const Vector3d along = Vector3d::UnitZ().cross(front);
    const Vector2d middle = station.leftBy(left_m);
    const Vector3d foot(middle.x(), middle.y(), 0);
    const Vector3d left_end = foot - 0.5 * size_m.y() * along;
    const Vector3d right_end = foot + 0.5 * size_m.y() * along;
    const Scene::Painter paint = painting_.clutter(kFacadeM, 1.0);
    addPanels(scene_, {left_end, along, Vector3d::UnitZ(), size_m.y(), size_m.z()}, kStreetPanelM,
              paint);
    addPanels(scene_,
              {left_end - size_m.x() * front, front, Vector3d::UnitZ(), size_m.x(), size_m.z()},
              2 * kStreetPanelM, paint);
    addPanels(scene_, {right_end, -front, Vector3d::UnitZ(), size_m.x(), size_m.z()},
              2 * kStreetPanelM, paint);
  }

  void addHouses(double side) {
    double s = 0;
    while (s < line_.length()) {
      const double width = random_.uniform(6, 10);
      const double set_back = random_.uniform(0, 1.5);
      const MiddleLine::Station station = line_.at(s + 0.5 * width);
      const double left = side * (kFacadeM + set_back);
      if (isFree(station.leftBy(left + side * 2.5), 2.5)) {
        addHouse(station, left, {5, width, random_.uniform(5, 11)});
      }
      s += width + random_.uniform(0, 1.2);
    }
  }

  void addRoadside(double side) {
    double s = random_.uniform(0, 4);
    while (s < line_.length() - 3) {
      const MiddleLine::Station station = line_.at(s);
      switch (random_.below(3)) {
        case 0:
          addLampPost(station, side);
          s += random_.uniform(2, 4);
          break;
        case 1:
          addCar(station, side);
          s += random_.uniform(5, 7);
          break;
        default:
          addBin(station, side);
          s += random_.uniform(1.5, 3);
      }
    }
  }

  void addLampPost(const MiddleLine::Station& station, double side) {
    const Vector2d at = station.leftBy(side * random_.uniform(3.6, 4.2));
    const double length = random_.uniform(3.5, 5.5);
    const auto tone = static_cast<float>(random_.uniform(-0.9, 0.9));
    if (!isFree(at, 0.1)) return;
    addStandingPole(scene_, {at.x(), at.y(), 0}, random_.uniform(0.06, 0.1), length,
                    painting_.rings(kNearestM, 0.5, tone, tone > 0 ? 0.6F : -0.6F));
    addStandingBox(scene_, {at.x(), at.y(), length}, {0.7, 0.4, 0.5}, station.yawDegrees(),
                   painting_.clutter(kNearestM, 0.3));
  }

  void addCar(const MiddleLine::Station& station, double side) {
    const Vector2d at = station.leftBy(side * 5);
    if (!isFree(at, 1.0)) return;
    const double yaw = station.yawDegrees();
    addStandingBox(scene_, {at.x(), at.y(), 0.25}, {4.2, 1.7, 0.65}, yaw,
                   painting_.clutter(kNearestM, 0.5));
    addStandingBox(scene_, {at.x(), at.y(), 0.9}, {2.3, 1.5, 0.55}, yaw,
                   painting_.clutter(kNearestM, 0.5));
  }

  void addBin(const MiddleLine::Station& station, double side) {
    const Vector2d at = station.leftBy(side * random_.uniform(4, 5.5));
    if (!isFree(at, 0.6)) return;
    const double width = random_.uniform(0.6, 1.1);
    addStandingBox(scene_, {at.x(), at.y(), 0}, {width, 0.8 * width, random_.uniform(0.8, 1.5)},
                   station.yawDegrees() + random_.uniform(-20, 20),
                   painting_.clutter(kNearestM, 0.35));
  }

  MiddleLine line_;
  Painting painting_;
  RandomNumbers random_;
  Scene scene_;
};

}  // namespace

Scene makeRoom(const RoomOptions& options) {
  requireOption(options.size_m.x() >= 3 && options.size_m.y() >= 3 && options.size_m.z() >= 2,
                "room", options.size_m.transpose(), "at least 3 x 3 x 2 m");
  Painting painting(PaintingOptions{options.seed, options.focal_px});
  RandomNumbers random(options.seed, 1);
  Scene scene;
  addFloorAndCeiling(scene, options, painting);
  for (int side = 0; side < 4; ++side) {
    const FurnishedWall wall = wallOf(options, side);
    const Eigen::Quaterniond& R_world_wall = wall.T_world_wall.rotation;
    // The normal, z x x, is the wall's y axis, which points into the room.
    addPanels(scene,
              {wall.T_world_wall.translation, R_world_wall * Vector3d::UnitZ(),
               R_world_wall * Vector3d::UnitX(), wall.height_m, wall.length_m},
              kRoomPanelM,
              painting.clutter(options.nearest_m + 0.5 * options.furniture_depth_m, 0.32));
    furnishWall(scene, wall, painting, random);
  }
  return scene;
}

Scene makePoles(const PolesOptions& options) {
  requireOption(options.nearest_m > 0, "nearest_m", options.nearest_m, "above 0");
  requireOption(options.farthest_m > options.nearest_m, "farthest_m", options.farthest_m,
                "above nearest_m");
  requireOption(options.wall_m > options.farthest_m, "wall_m", options.wall_m, "above farthest_m");
  Painting painting(PaintingOptions{options.seed, options.focal_px});
  RandomNumbers random(options.seed, 1);
  Scene scene;
  const double half_wall = 1.6 * options.half_view * options.wall_m + 0.5;
  addPanels(scene,
            {{-half_wall, options.wall_m, -half_wall},
             Vector3d::UnitX(),
             Vector3d::UnitZ(),
             2 * half_wall,
             2 * half_wall},
            1.5, painting.clutter(options.wall_m - 0.3, 0.1 * options.wall_m));
  for (int i = 0; i < options.poles; ++i) {
    // Depths are even in inverse depth. Poles of similar depth are far apart sideways, so that no
    // pole hides another pole.
    const double fraction = (i + random.uniform(0.2, 0.8)) / options.poles;
    const double depth = 1 / ((1 - fraction) / options.nearest_m + fraction / options.farthest_m);
    const double side = (i * 5 % options.poles + random.uniform(0.2, 0.8)) / options.poles;
    Rigid3 T_world_pole;
    T_world_pole.translation = {(2 * side - 1) * 0.9 * options.half_view * depth, depth, 0};
    // The pole leans to the side: its depth is constant.
    T_world_pole.rotation = Eigen::AngleAxisd(random.uniform(-0.45, 0.45), Vector3d::UnitY());
    // 3 to 6 pixels wide.
    const double radius = random.uniform(1.5, 3) * depth / options.focal_px;
    const auto tone =
        static_cast<float>(i % 2 == 0 ? random.uniform(0.9, 1.3) : random.uniform(-1.3, -0.9));
    scene.addPole({T_world_pole, radius, 2.6 * options.half_view * depth},
                  painting.rings(depth, 0.12 * depth, tone, i % 2 == 0 ? 0.5F : -0.5F));
  }
  return scene;
}

Scene makeStreet(const StreetOptions& options) { return StreetBuilder(options).build(); }

}  // namespace efm
