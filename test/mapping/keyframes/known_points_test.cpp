// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "mapping/keyframes/keyframe_mapper.h"
#include "mapping/keyframes/keyframe_policy.h"
#include "test/mapping/keyframes/random_scene.h"

namespace efm::known_points_test {
namespace {

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
constexpr std::int64_t kDuration_ns = 300'000'000;

CameraModel camera240() {
  return {240, 180, 200, 198, 121.5, 88.2, DistortionModel::kRadtan, {-0.1, 0.05, 0.0005, -0.0003}};
}

/// Three cameras that move half a metre to the right in all, turning a little.
struct MovingRig {
  Rig rig;
  Trajectory trajectory;

  MovingRig() {
    test::RandomScene random(1);
    for (std::int64_t t_ns = kStart_ns; t_ns <= kStart_ns + kDuration_ns; t_ns += 5'000'000) {
      const double share = static_cast<double>(t_ns - kStart_ns) / kDuration_ns;
      const Eigen::Vector3d axis = Eigen::Vector3d(0.2, 1, 0.3).normalized();
      trajectory.add({t_ns,
                      {Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * (share - 0.5), axis)),
                       {0.5 * (share - 0.5), 0.05 * std::sin(6 * share), 0.1 * share}}});
    }
    rig.cameras.push_back({camera240(), {}, 0});
    rig.cameras.push_back({camera240(), {random.pose(0.01, 0.02).rotation, {0.1, 0, 0}}, 0});
    rig.cameras.push_back({camera240(), {random.pose(0.01, 0.1).rotation, {0.05, -0.1, 0}}, 0});
  }

  Rigid3 T_world_cam(std::size_t camera, std::int64_t t_ns) const {
    return *trajectory.poseAt(t_ns) * rig.cameras[camera].T_rig_cam;
  }
  /// The raw pixel that sees a point, where one does.
  std::optional<cv::Point> pixelOf(std::size_t camera, std::int64_t t_ns,
                                   const Eigen::Vector3d& p_world) const {
    const CameraModel& model = rig.cameras[camera].model;
    const Eigen::Vector2d raw = model.project(T_world_cam(camera, t_ns).inverse() * p_world);
    const cv::Point pixel(static_cast<int>(std::lround(raw.x())),
                          static_cast<int>(std::lround(raw.y())));
    if (!cv::Rect(0, 0, model.width, model.height).contains(pixel)) return std::nullopt;
    return pixel;
  }
  bool seesAllTheTime(const Eigen::Vector3d& p_world) const {
    for (const std::int64_t t_ns : {kStart_ns, kStart_ns + kDuration_ns}) {
      if (!pixelOf(0, t_ns, p_world) || !pixelOf(1, t_ns, p_world)) return false;
    }
    return true;
  }
  std::vector<Event> eventsOf(std::size_t camera,
                              const std::vector<Eigen::Vector3d>& points_world) const {
    std::vector<Event> seen;
    for (std::int64_t t_ns = kStart_ns; t_ns < kStart_ns + kDuration_ns; t_ns += 2'500'000) {
      for (const Eigen::Vector3d& p_world : points_world) {
        const auto pixel = pixelOf(camera, t_ns, p_world);
        if (!pixel) continue;
        seen.push_back({t_ns, static_cast<std::uint16_t>(pixel->x),
                        static_cast<std::uint16_t>(pixel->y), true});
      }
    }
    return seen;
  }
};

/// A point behind the centre of a pixel of the reference view.
struct KnownPoint {
  cv::Point pixel;
  double depth_m = 0;
};

/// Points apart from each other that both cameras see all the time.
std::vector<KnownPoint> randomPoints(const MovingRig& moving, const ReferenceView& view,
                                     const Rigid3& T_world_ref) {
  test::RandomScene random(2);
  std::vector<KnownPoint> points;
  for (int draw = 0; draw < 300; ++draw) {
    const KnownPoint point{{static_cast<int>(random.uniform(6, view.width - 6)),
                            static_cast<int>(random.uniform(6, view.height - 6))},
                           1 / random.uniform(1 / 3.5, 1 / 1.0)};
    bool good = moving.seesAllTheTime(T_world_ref *
                                      view.pointAt(point.pixel.x, point.pixel.y, point.depth_m));
    for (const KnownPoint& other : points) {
      good = good && cv::norm(point.pixel - other.pixel) > 12;
    }
    if (good && points.size() < 30) points.push_back(point);
  }
  return points;
}

/// 60 planes, each 1.7 pixels of parallax from the next over the whole motion: that events are
/// rounded to pixels does not move a peak by a plane.
constexpr int kPlanes = 60;
const double kPlaneStep = (1 / 0.8 - 1 / 4.0) / (kPlanes - 1);

struct ViewCase {
  std::string name;
  std::function<void(KeyframeMapperOptions&)> change;
  ReferenceTime reference = ReferenceTime::kMiddle;
};

std::vector<ViewCase> viewCases() {
  return {
      {"the camera's own view", [](auto&) {}},
      {"at the end", [](auto&) {}, ReferenceTime::kEnd},
      {"wider",
       [](auto& o) {
         o.view.fov_deg = 90;
         o.view.width = 400;
         o.view.height = 300;
       }},
      {"finer", [](auto& o) { o.view.width = 360; }},
      {"shifted",
       [](auto& o) {
         o.view.offset_m = {0.1, -0.05, -0.3};
       }},
      {"another, unselected camera's", [](auto& o) { o.reference_camera = 2; }},
      {"all of it",
       [](auto& o) {
         o.reference_camera = 2;
         o.view.fov_deg = 80;
         o.view.width = 380;
         o.view.height = 280;
         o.view.offset_m = {0.05, 0, -0.2};
       },
       ReferenceTime::kEnd},
      {"linear planes", [](auto& o) { o.planes.spacing = PlaneSpacing::kLinear; }},
      {"500 planes", [](auto& o) { o.planes.num_planes = 500; }},
      {"four shifted sub-intervals",
       [](auto& o) {
         o.subintervals.count = 4;
         o.subintervals.shuffle = SubintervalShuffle::kShift;
       }},
  };
}

struct Found {
  std::vector<KnownPoint> points;
  KeyframeDepthMap keyframe;
};

/// The reference view and its pose are computed here, independent of the mapper.
Found mapPoints(const ViewCase& view_case) {
  const MovingRig moving;
  KeyframeMapperOptions options;
  options.planes = {0.8, 4.0, kPlanes, PlaneSpacing::kInverse};
  // Around a point that stands alone, pixels beside it see its rays cross a little nearer and a
  // little farther: their median says nothing of the point.
  options.extraction.median_size = 1;
  view_case.change(options);
  const Window window = windowOf(kStart_ns, kStart_ns + kDuration_ns, view_case.reference);
  const auto camera = static_cast<std::size_t>(options.reference_camera);
  Rigid3 T_world_ref = moving.T_world_cam(camera, view_case.reference == ReferenceTime::kEnd
                                                      ? kStart_ns + kDuration_ns
                                                      : kStart_ns + kDuration_ns / 2);
  T_world_ref.translation += T_world_ref.rotation * options.view.offset_m;
  const ReferenceView view = makeReferenceView(moving.rig.cameras[camera].model, options.view);

  Found found{randomPoints(moving, view, T_world_ref), {}};
  std::vector<Eigen::Vector3d> points_world;
  for (const KnownPoint& point : found.points) {
    points_world.push_back(T_world_ref * view.pointAt(point.pixel.x, point.pixel.y, point.depth_m));
  }
  std::vector<std::vector<Event>> events;
  for (std::size_t c = 0; c < 3; ++c) events.push_back(moving.eventsOf(c, points_world));
  KeyframeMapper mapper(moving.rig, {0, 1}, options);
  const auto keyframe = mapper.map(window, {events.begin(), events.end()}, moving.trajectory);
  EXPECT_TRUE(keyframe);
  found.keyframe = keyframe.value_or(KeyframeDepthMap());
  EXPECT_LT((found.keyframe.T_world_ref.translation - T_world_ref.translation).norm(), 1e-12);
  return found;
}

TEST(KnownPoints, AreFoundInAnyReferenceView) {
  for (const ViewCase& view_case : viewCases()) {
    const Found found = mapPoints(view_case);
    EXPECT_GE(found.points.size(), 15U) << view_case.name;
    for (const KnownPoint& point : found.points) {
      const double depth_m = found.keyframe.map.depth(point.pixel);
      ASSERT_GT(depth_m, 0) << view_case.name << ": nothing at " << point.pixel;
      EXPECT_NEAR(1 / depth_m, 1 / point.depth_m, kPlaneStep) << view_case.name << point.pixel;
    }
  }
}

TEST(KnownPoints, HaveErrorsWithinTheirVariance) {
  double squared_errors = 0;
  double variances = 0;
  const Found found = mapPoints(viewCases().front());
  for (const KnownPoint& point : found.points) {
    const double variance = found.keyframe.map.variance(point.pixel);
    EXPECT_TRUE(std::isfinite(variance)) << "no point lies at the limits";
    squared_errors += std::pow(1 / found.keyframe.map.depth(point.pixel) - 1 / point.depth_m, 2);
    variances += variance;
  }
  // Nothing but rounding is wrong with these events: real ones err more.
  EXPECT_GT(variances, squared_errors);
  EXPECT_LT(variances, 100 * squared_errors);
}

}  // namespace
}  // namespace efm::known_points_test
