// SPDX-License-Identifier: BSD-3-Clause
#include "test/bench/synthetic_window.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "mapping/geometry/lens.h"

namespace efm::bench {
namespace {

constexpr std::int64_t kStart_ns = 1'000'000'000;
constexpr std::int64_t kPoseStep_ns = 5'000'000;
constexpr double kBaseline_m = 0.1;
constexpr int kEdges = 400;
constexpr double kNoiseFraction = 0.1;

struct Edge {
  Eigen::Vector3d from;
  Eigen::Vector3d to;
};

/// Returns a camera of any size with the field of view of a DAVIS346.
CameraModel cameraOf(const SyntheticWindowOptions& options) {
  const double scale = options.width / 346.0;
  CameraModel model{options.width,
                    options.height,
                    226.0 * scale,
                    226.0 * scale,
                    0.5 * (options.width - 1),
                    0.5 * (options.height - 1),
                    DistortionModel::kNone,
                    {}};
  if (options.strong_lens) {
    model.fx = model.fy = 180.0 * scale;
    model.distortion = DistortionModel::kRadtan;
    model.coefficients = {-0.3, 0.08, 0, 0};
  }
  return model;
}

Rig rigOf(const SyntheticWindowOptions& options) {
  Rig rig;
  for (int c = 0; c < options.cameras; ++c) {
    const Rigid3 T_rig_cam{Eigen::Quaterniond::Identity(), {kBaseline_m * c, 0, 0}};
    rig.cameras.push_back({cameraOf(options), T_rig_cam, 0});
  }
  return rig;
}

/// Returns a pose of a motion to and fro at 0.5 m/s with small rotations.
Rigid3 handHeldPose(double t_s) {
  const Eigen::Vector3d position(0.08 * std::sin(7 * t_s), 0.05 * std::sin(9 * t_s + 1),
                                 0.04 * std::sin(6 * t_s + 2));
  const Eigen::Vector3d rotation(0.03 * std::sin(8 * t_s), 0.04 * std::sin(5 * t_s),
                                 0.03 * std::sin(6 * t_s + 1));
  return {Eigen::Quaterniond(Eigen::AngleAxisd(rotation.norm(), rotation.normalized())), position};
}

/// @param fraction time as a fraction of the window, -0.5 to 0.5.
Rigid3 poseOf(const WindowMotion& motion, double fraction) {
  constexpr double kRadPerDeg = 3.14159265358979323846 / 180;
  const Eigen::Quaterniond turn(
      Eigen::AngleAxisd(fraction * motion.turn_deg * kRadPerDeg, Eigen::Vector3d::UnitY()));
  const Eigen::Vector3d circled(0, 0, motion.circled_m);
  return {turn, fraction * motion.travel_m + circled - turn * circled};
}

Trajectory trajectoryOver(const SyntheticWindowOptions& options) {
  const double duration_s = options.duration_s;
  Trajectory trajectory;
  for (int i = -1;; ++i) {
    const std::int64_t t_ns = i * kPoseStep_ns;
    const double t_s = 1e-9 * static_cast<double>(t_ns);
    trajectory.add({kStart_ns + t_ns, options.motion
                                          ? poseOf(*options.motion, t_s / duration_s - 0.5)
                                          : handHeldPose(1 + t_s)});
    if (t_s > duration_s) return trajectory;
  }
}

/// Returns edges on surfaces: the view is divided into parts, and each has its own depth.
std::vector<Edge> randomEdges(std::mt19937& random) {
  constexpr double kSide = 0.9;  // of the view, at a distance of 1
  constexpr double kAspect = 0.75;
  constexpr int kColumns = 6;
  constexpr int kRows = 4;
  std::uniform_real_distribution<double> depth_m(1, 6);
  std::uniform_real_distribution<double> side(-1, 1);
  std::normal_distribution<double> extent(0, 0.13);  // relative to the distance
  double surfaces_m[kRows][kColumns];
  for (auto& row : surfaces_m) {
    for (double& surface_m : row) surface_m = depth_m(random);
  }
  std::vector<Edge> edges;
  for (int i = 0; i < kEdges; ++i) {
    const double x = side(random);
    const double y = side(random);
    const double z = surfaces_m[static_cast<int>(0.5 * (y + 1) * kRows)]
                               [static_cast<int>(0.5 * (x + 1) * kColumns)];
    const Eigen::Vector3d from(kSide * x * z, kAspect * kSide * y * z, z);
    edges.push_back(
        {from, from + z * Eigen::Vector3d(extent(random), extent(random), 0.1 * extent(random))});
  }
  return edges;
}

class EventMaker {
 public:
  EventMaker(const CameraModel& model, const std::vector<Edge>& edges, std::mt19937& random)
      : pinhole_(ReferenceView::of(model)), edges_(edges), random_(random) {}

  /// Draws an event of a random point of a random edge, or noise.
  Event event(std::int64_t t_ns, const Rigid3& T_cam_world) {
    if (uniform_(random_) >= kNoiseFraction) {
      constexpr int kTries = 20;  // points outside of the image are drawn again
      for (int i = 0; i < kTries; ++i) {
        const auto& edge = edges_[random_() % edges_.size()];
        const double along = uniform_(random_);
        const Eigen::Vector3d point = T_cam_world * ((1 - along) * edge.from + along * edge.to);
        if (point.z() < 0.1) continue;
        const Eigen::Vector2d pixel = pinhole_.project(point).array().round();
        if (pixel.x() < 0 || pixel.x() >= pinhole_.width || pixel.y() < 0 ||
            pixel.y() >= pinhole_.height) {
          continue;
        }
        return {t_ns, static_cast<std::uint16_t>(pixel.x()), static_cast<std::uint16_t>(pixel.y()),
                random_() % 2 == 0};
      }
    }
    return {t_ns, static_cast<std::uint16_t>(random_() % static_cast<unsigned>(pinhole_.width)),
            static_cast<std::uint16_t>(random_() % static_cast<unsigned>(pinhole_.height)),
            random_() % 2 == 0};
  }

 private:
  ReferenceView pinhole_;
  const std::vector<Edge>& edges_;
  std::mt19937& random_;
  std::uniform_real_distribution<double> uniform_{0, 1};
};

}  // namespace

SyntheticWindow makeSyntheticWindow(const SyntheticWindowOptions& options) {
  SyntheticWindow made;
  made.rig = rigOf(options);
  made.trajectory = trajectoryOver(options);
  const auto duration_ns = static_cast<std::int64_t>(1e9 * options.duration_s);
  made.window = {kStart_ns, kStart_ns + duration_ns, kStart_ns + duration_ns / 2};
  made.options.split = SplitFusionOptions::none();
  made.options.extraction.extraction = ExtractionMethod::kPaper;
  made.options.planes.min_depth_m = kNearLimit_m;
  made.options.planes.max_depth_m = 8.0;

  std::mt19937 random(options.seed);
  const std::vector<Edge> edges = randomEdges(random);
  for (const RigCamera& camera : made.rig.cameras) {
    EventMaker maker(camera.model, edges, random);
    std::vector<Event>& events = made.events.emplace_back();
    events.reserve(options.events_per_camera);
    const auto count = static_cast<std::int64_t>(options.events_per_camera);
    for (std::int64_t i = 0; i < count; ++i) {
      const std::int64_t t_ns =
          kStart_ns + duration_ns / count * i + duration_ns % count * i / count;
      const Rigid3 T_world_cam = *made.trajectory.poseAt(t_ns) * camera.T_rig_cam;
      events.push_back(maker.event(t_ns, T_world_cam.inverse()));
    }
  }
  return made;
}

SweepInput makeSweepInput(const SyntheticWindow& made, int planes) {
  DepthPlanesOptions options = made.options.planes;
  options.num_planes = planes;
  const RigCamera& reference = made.rig.cameras.front();
  SweepInput input{ReferenceView::of(reference.model), DepthPlanes(options), {}, {}};
  const Rigid3 T_world_ref = *made.trajectory.poseAt(made.window.t_ref_ns) * reference.T_rig_cam;
  const PacketGeometry geometry{T_world_ref.inverse(), input.view, input.planes.depth(0),
                                input.planes.depth(planes - 1)};
  for (std::size_t c = 0; c < made.events.size(); ++c) {
    const RigCamera& camera = made.rig.cameras[c];
    const UndistortionTable undistortion(camera.model);
    const PosePackets& packets = input.packets.emplace_back(splitIntoPosePackets(
        made.events[c], camera, undistortion, made.trajectory, geometry, made.options.packets));
    input.cameras.push_back({backProject(made.events[c], packets, undistortion, input.view)});
  }
  return input;
}

}  // namespace efm::bench
