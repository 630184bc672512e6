// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <random>
#include <utility>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/geometry/trajectory.h"
#include "plugin/options/option_file.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {

/// The scene and the motion of a synthetic recording.
struct SyntheticScene {
  double depth_m = 2;
  double speed_m_s = 0.8;
  double rest_s = 0;                    ///< Duration of standstill at the beginning.
  int noise_per_step = 0;               ///< Events of each camera at random pixels, per ms.
  std::vector<Eigen::Vector3d> dots{};  ///< In world; if empty, random dots in the view.
};

/// Bright dots on the plane z = 2 m in world, seen by a stereo rig that moves along x without
/// turning. A dot makes an event when it enters another pixel. Small, exact, always the same.
struct SyntheticRecording {
  static constexpr double kDepthM = 2.0;
  static constexpr std::int64_t kStartNs = 10'000'000'000;  // a recording's clock is not 0 at first
  static constexpr std::int64_t kStepNs = 1'000'000;

  std::vector<RigCamera> cameras;
  std::vector<std::vector<Event>> events;  ///< Per camera, in time order.
  std::vector<StampedPose> poses;          ///< Every 10 ms, from the start to the end.

  /// Moves at 0.8 m/s for `duration_s`; camera 1 is 0.1 m to the right of camera 0.
  explicit SyntheticRecording(double duration_s = 0.5, int num_cameras = 2,
                              const SyntheticScene& scene = {})
      : scene_(scene) {
    for (int c = 0; c < num_cameras; ++c) {
      RigCamera camera;
      camera.model = {120, 90, 100.0, 100.0, 59.5, 44.5, DistortionModel::kNone, {}};
      camera.T_rig_cam.translation = {0.1 * c, 0, 0};
      cameras.push_back(camera);
    }
    const std::vector<Eigen::Vector3d> dots = scene_.dots.empty() ? randomDots() : scene_.dots;
    const auto steps = static_cast<std::int64_t>(std::llround(duration_s * 1e9)) / kStepNs;
    for (const RigCamera& camera : cameras) events.push_back(eventsOf(camera, dots, steps));
    for (std::int64_t step = 0; step <= steps; step += 10) {
      poses.push_back({kStartNs + step * kStepNs, poseAt(step)});
    }
  }

  std::size_t totalEvents() const {
    std::size_t total = 0;
    for (const auto& one : events) total += one.size();
    return total;
  }

 private:
  Rigid3 poseAt(std::int64_t step) const {
    Rigid3 T_world_rig;
    const std::int64_t t_ns = step * kStepNs - std::llround(scene_.rest_s * 1e9);
    T_world_rig.translation = {
        scene_.speed_m_s * static_cast<double>(std::max<std::int64_t>(0, t_ns)) * 1e-9, 0, 0};
    return T_world_rig;
  }

  std::vector<Eigen::Vector3d> randomDots() const {
    std::mt19937 random(7);
    std::vector<Eigen::Vector3d> dots;
    for (int i = 0; i < 60; ++i) {
      const double x = -1.5 + 4.0 * (static_cast<double>(random()) / 4294967296.0);
      const double y = -0.8 + 1.6 * (static_cast<double>(random()) / 4294967296.0);
      dots.push_back(scene_.depth_m / kDepthM * Eigen::Vector3d(x, y, kDepthM));
    }
    return dots;
  }

  std::vector<Event> eventsOf(const RigCamera& camera, const std::vector<Eigen::Vector3d>& dots,
                              std::int64_t steps) const {
    std::vector<Event> seen;
    std::mt19937 random(11 + static_cast<std::uint32_t>(1000 * camera.T_rig_cam.translation.x()));
    std::vector<Eigen::Vector2i> last(dots.size(), {-1, -1});
    for (std::int64_t step = 0; step <= steps; ++step) {
      const Rigid3 T_cam_world = (poseAt(step) * camera.T_rig_cam).inverse();
      for (std::size_t i = 0; i < dots.size(); ++i) {
        const Eigen::Vector2d pixel = camera.model.project(T_cam_world * dots[i]);
        const Eigen::Vector2i rounded = pixel.array().round().cast<int>();
        if (rounded == last[i]) continue;
        last[i] = rounded;
        if (step == 0 || rounded.minCoeff() < 0 || rounded.x() >= camera.model.width ||
            rounded.y() >= camera.model.height) {
          continue;
        }
        seen.push_back({kStartNs + step * kStepNs, static_cast<std::uint16_t>(rounded.x()),
                        static_cast<std::uint16_t>(rounded.y()), step % 2 == 0});
      }
      for (int i = 0; i < scene_.noise_per_step; ++i) {
        seen.push_back({kStartNs + step * kStepNs, static_cast<std::uint16_t>(random() % 120),
                        static_cast<std::uint16_t>(random() % 90), step % 2 == 0});
      }
    }
    return seen;
  }

  SyntheticScene scene_;
};

/// Returns options for the synthetic recording: they give three keyframes in half a second.
inline EventFusionOptions syntheticOptions() {
  EventFusionOptions options;
  options.mapper.policy.window_s = 0.2;
  options.mapper.policy.stride_s = 0.1;
  options.mapper.fill_last_window = false;  // as in live operation; tests compare it with playback
  options.mapper.keyframe.planes = {1, 5, 30, PlaneSpacing::kInverse};
  options.mapper.keyframe.extraction.threshold_c = 60;  // single dots stand out strongly
  options.mapper.keyframe.extraction.min_probability = 0;  // and they are no edges
  return options;
}

/// Writes a synthetic recording as a dataset folder.
inline void writeDataset(const SyntheticRecording& recording, const std::filesystem::path& folder) {
  Rig rig;
  rig.cameras = recording.cameras;
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    const auto camera = folder / ("cam" + std::to_string(c));
    std::filesystem::create_directories(camera);
    writeEvents(camera / "events.txt", recording.events[c]);
  }
  std::ofstream(folder / "camchain.yaml") << formatCamchain(rig);
  writeTumTrajectory(folder / "poses.txt", recording.poses);
}

/// Pose errors of a simulated tracker: standard deviations per axis, drawn for each keyframe.
struct Shake {
  double noise_m = 0.01;
  double noise_rad = 0.005;
  unsigned seed = 1;
};
inline constexpr std::int64_t kShakenWindowNs = 100'000'000;

/// Returns the recording with wrong poses. The error is constant within each window of 0.1 s.
inline SyntheticRecording shaken(SyntheticRecording recording, const Shake& shake = {}) {
  std::mt19937 random(shake.seed);
  std::normal_distribution<double> normal;
  const auto draw = [&](double sigma) {
    const double x = normal(random);
    const double y = normal(random);
    return Eigen::Vector3d(sigma * Eigen::Vector3d(x, y, normal(random)));
  };
  std::int64_t window = -1;
  Rigid3 T_rig_shaken;
  for (StampedPose& pose : recording.poses) {
    const std::int64_t within = (pose.t_ns - SyntheticRecording::kStartNs) / kShakenWindowNs;
    if (std::exchange(window, within) != within) {
      const Eigen::Vector3d turn = draw(shake.noise_rad);
      T_rig_shaken.rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized());
      T_rig_shaken.translation = draw(shake.noise_m);
    }
    pose.T_world_rig = pose.T_world_rig * T_rig_shaken;
  }
  return recording;
}

/// Returns options for a shaken recording: one keyframe per window of 0.1 s, with pose refinement.
inline EventFusionOptions refinedOptions() {
  EventFusionOptions options = syntheticOptions();
  options.mapper.policy.window_s = 0.1;
  options.mapper.policy.stride_s = 0.1;
  options.cloud.voxel_size_m = 0.02;
  options.refinement.enabled = true;
  return options;
}

}  // namespace efm
