// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/presets/presets.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "tracking_stub/motion/motion.h"
#include "tracking_stub/scenes/scenes.h"

namespace efm {
namespace {

using Eigen::Vector3d;

/// The path of camera 0. The scene is built around this path.
struct CameraPath {
  std::vector<Vector3d> positions;  // frame `level`
  Eigen::AlignedBox3d box;          // around the positions
  Rigid3 T_world_level;             // y: the mean viewing direction; z: up
  double focal_px = 0;              // the longest focal length of all cameras
  double half_view = 0;             // half of the widest camera's view at a depth of 1 m, metres
  std::uint64_t seed = 0;
};

Eigen::Quaterniond levelFrame(const std::vector<Rigid3>& T_world_cams) {
  Vector3d down = Vector3d::Zero();
  Vector3d ahead = Vector3d::Zero();
  for (const Rigid3& T_world_cam : T_world_cams) {
    down += T_world_cam.rotation * Vector3d::UnitY();
    ahead += T_world_cam.rotation * Vector3d::UnitZ();
  }
  // A camera that looks in all directions has no mean direction: its first direction is used.
  const auto n = static_cast<double>(T_world_cams.size());
  if (down.norm() < 0.1 * n) down = T_world_cams.front().rotation * Vector3d::UnitY();
  const Vector3d up = -down.normalized();
  ahead -= ahead.dot(up) * up;
  if (ahead.norm() < 0.1 * n) ahead = T_world_cams.front().rotation * Vector3d::UnitZ();
  ahead -= ahead.dot(up) * up;
  if (ahead.norm() < 1e-6) ahead = up.unitOrthogonal();
  Eigen::Matrix3d R_world_level;
  R_world_level.col(1) = ahead.normalized();
  R_world_level.col(2) = up;
  R_world_level.col(0) = R_world_level.col(1).cross(up);
  return Eigen::Quaterniond(R_world_level);
}

CameraPath pathOf(const Simulation& simulation) {
  constexpr std::int64_t kSampleNs = 50'000'000;
  std::vector<Rigid3> T_world_cams;
  for (std::int64_t t_ns = simulation.start_ns; t_ns < simulation.endNs(); t_ns += kSampleNs) {
    T_world_cams.push_back(simulation.motion->poseAt(t_ns));
  }
  T_world_cams.push_back(simulation.motion->poseAt(simulation.endNs()));
  CameraPath path;
  path.T_world_level.rotation = levelFrame(T_world_cams);
  const Rigid3 T_level_world = path.T_world_level.inverse();
  for (const Rigid3& T_world_cam : T_world_cams) {
    path.positions.push_back(T_level_world * T_world_cam.translation);
    path.box.extend(path.positions.back());
  }
  for (const RigCamera& camera : simulation.rig.cameras) {
    const CameraModel& model = camera.model;
    path.focal_px = std::max({path.focal_px, model.fx, model.fy});
    path.half_view = std::max(path.half_view, 0.5 * model.width / model.fx);
  }
  path.seed = simulation.seed;
  return path;
}

/// Moves a scene so that its origin is at a position in frame `level`.
Scene movedTo(Scene scene, const CameraPath& path, const Vector3d& origin_level) {
  Rigid3 T_level_scene;
  T_level_scene.translation = origin_level;
  scene.move(path.T_world_level * T_level_scene);
  return scene;
}

Scene roomAround(const CameraPath& path) {
  constexpr double kSideM = 1.9;
  constexpr double kBelowM = 1.2;
  constexpr double kAboveM = 1.4;
  const Vector3d extent = path.box.sizes();
  RoomOptions room;
  room.size_m = {std::max(4.8, extent.x() + 2 * kSideM), std::max(5.4, extent.y() + 2 * kSideM),
                 extent.z() + kBelowM + kAboveM};
  room.nearest_m = kSideM - room.furniture_depth_m;
  room.focal_px = path.focal_px;
  room.seed = path.seed;
  Vector3d foot = path.box.center();
  foot.z() = path.box.min().z() - kBelowM;
  return movedTo(makeRoom(room), path, foot);
}

Scene streetAlong(const CameraPath& path) {
  constexpr double kCameraHeightM = 1.6;
  StreetOptions street;
  for (const Vector3d& position : path.positions) street.path.emplace_back(position.head<2>());
  // A camera at rest looks down the street.
  if (path.box.sizes().head<2>().norm() < 1) {
    street.path = {street.path.front(), street.path.front() + Eigen::Vector2d::UnitY()};
  }
  street.focal_px = path.focal_px;
  street.seed = path.seed;
  return movedTo(makeStreet(street), path, {0, 0, path.box.min().z() - kCameraHeightM});
}

Scene polesBefore(const CameraPath& path) {
  PolesOptions poles;
  poles.focal_px = path.focal_px;
  poles.half_view = path.half_view;
  poles.seed = path.seed;
  Vector3d front = path.box.center();
  front.y() = path.box.max().y();
  return movedTo(makePoles(poles), path, front);
}

using MakeScene = Scene (*)(const CameraPath& path);

constexpr NamedChoice<MakeScene> kScenes[] = {
    {roomAround, "room"},
    {streetAlong, "street"},
    {polesBefore, "poles"},
};

/// Returns the poses of a time interval and of 2 s before and after the interval, for smoothing.
std::vector<StampedPose> posesAround(const std::vector<StampedPose>& poses, std::int64_t start_ns,
                                     std::int64_t end_ns) {
  constexpr std::int64_t kMarginNs = 2 * kNanosecondsPerSecond;
  std::vector<StampedPose> some;
  for (const StampedPose& pose : poses) {
    if (pose.t_ns >= start_ns - kMarginNs && pose.t_ns <= end_ns + kMarginNs) some.push_back(pose);
  }
  return some;
}

}  // namespace

std::vector<std::string> simulationScenes() {
  std::vector<std::string> names;
  for (const auto& scene : kScenes) names.emplace_back(scene.name);
  return names;
}

void moveAlong(const SimulationOptions& options, Simulation& simulation) {
  constexpr double kDurationS = 5;
  const bool has_scene = !options.scene.empty();
  const MakeScene make = has_scene ? makerIn(kScenes, "scene", options.scene) : nullptr;
  requireOption(options.poses.size() >= 2, "poses", options.poses.size(), "at least 2");
  std::vector<StampedPose> poses = options.poses;
  std::stable_sort(poses.begin(), poses.end(),
                   [](const StampedPose& a, const StampedPose& b) { return a.t_ns < b.t_ns; });
  const std::int64_t last_ns = poses.back().t_ns;

  simulation.start_ns = options.start_ns.value_or(startOfMotion(poses));
  requireOption(simulation.start_ns >= poses.front().t_ns && simulation.start_ns < last_ns, "start",
                formatSeconds(simulation.start_ns),
                "within the trajectory, " + formatSeconds(poses.front().t_ns) + " to " +
                    formatSeconds(last_ns));
  const std::int64_t left_ns = last_ns - simulation.start_ns;
  simulation.duration_ns = options.duration_s ? durationFromSeconds(*options.duration_s)
                                              : std::min(durationFromSeconds(kDurationS), left_ns);
  requireOption(simulation.duration_ns <= left_ns, "duration_s",
                secondsBetween(0, simulation.duration_ns),
                "at most the " + formatSeconds(left_ns) + " s that are left of the trajectory");
  simulation.motion = std::make_shared<SampledMotion>(
      smoothTrajectory(posesAround(poses, simulation.start_ns, simulation.endNs())));
  if (!has_scene) return;
  if (options.scene == "street") {  // like drive_stereo
    simulation.truth_cell_m = 0.05;
    simulation.max_step_px = 1;
  }
  simulation.scene = make(pathOf(simulation));
}

}  // namespace efm
