// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "mapping/events/window.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/timestamp.h"
#include "mapping/survey/scene_depths.h"

namespace efm::test {

/// A rig in front of short edges, each at one depth. A point of an edge fires an event when it
/// enters another pixel.
struct EdgeWorld {
  double near_m = 1;
  double far_m = 3;
  double duration_s = 1.6;
  int edges = 40;
  double pixel_noise = 0.3;  ///< Standard deviation: edges are not perfect.
  /// The rig's pose as a function of the time in seconds.
  Rigid3 (*T_world_rig)(double) = handHeld;

  static Rigid3 handHeld(double t_s) {
    const Eigen::Vector3d rotation{0.15 * std::sin(4 * t_s), 0.2 * std::sin(3 * t_s + 1),
                                   0.1 * std::sin(5 * t_s)};
    return {rotationBy(Eigen::Vector3d{0.3, -0.2, 0.5}) * rotationBy(rotation),
            Eigen::Vector3d{0.2 * std::sin(2.5 * t_s), 0.15 * std::sin(3.5 * t_s + 2),
                            0.1 * std::sin(2 * t_s)}};
  }

  static Rig rig(std::size_t cameras) {
    Rig rig;
    for (std::size_t c = 0; c < cameras; ++c) {
      const CameraModel model{160, 120, 120, 120, 79.5, 59.5, DistortionModel::kNone, {}};
      rig.cameras.push_back({model,
                             {rotationBy({0, 0.05 * static_cast<double>(c), 0}),
                              {0.1 * static_cast<double>(c), 0.01 * static_cast<double>(c), 0}}});
    }
    return rig;
  }

  /// Returns the whole duration as one sample, with a pose every 5 ms.
  WindowSample sample(const Rig& rig) const {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::normal_distribution<double> noise(0, pixel_noise);
    std::vector<Eigen::Vector3d> points;
    std::vector<bool> polarities;
    const Rigid3 T_world_start = T_world_rig(0);
    for (int i = 0; i < edges; ++i) {
      const double depth_m = 1 / (1 / far_m + uniform(random) * (1 / near_m - 1 / far_m));
      const Eigen::Vector2d middle{2.4 * uniform(random) - 1.2, 2 * uniform(random) - 1};
      const double angle_rad = 3.1416 * uniform(random);
      const Eigen::Vector2d direction{std::cos(angle_rad), std::sin(angle_rad)};
      for (int k = -10; k <= 10; ++k) {  // 1.2 pixels apart
        const Eigen::Vector2d ray = middle + 0.01 * k * direction;
        points.push_back(T_world_start * Eigen::Vector3d(depth_m * ray.homogeneous()));
        polarities.push_back(i % 2 == 0);
      }
    }
    WindowSample sample;
    const std::int64_t end_ns = durationFromSeconds(duration_s);
    sample.window = {0, end_ns, end_ns / 2};
    for (std::int64_t t_ns = 0; t_ns <= end_ns; t_ns += 5'000'000) {
      sample.trajectory.add({t_ns, T_world_rig(secondsBetween(0, t_ns))});
    }
    for (const RigCamera& camera : rig.cameras) {
      std::vector<Event>& events = sample.events.emplace_back();
      std::vector<std::pair<int, int>> pixels(points.size(), {-1, -1});
      for (std::int64_t t_ns = 0; t_ns < end_ns; t_ns += 2'000'000) {
        const Rigid3 T_cam_world =
            (T_world_rig(secondsBetween(0, t_ns)) * camera.T_rig_cam).inverse();
        for (std::size_t i = 0; i < points.size(); ++i) {
          const Eigen::Vector3d p_cam = T_cam_world * points[i];
          if (p_cam.z() <= 0) continue;
          const double u = camera.model.fx * p_cam.x() / p_cam.z() + camera.model.cx;
          const double v = camera.model.fy * p_cam.y() / p_cam.z() + camera.model.cy;
          const std::pair<int, int> pixel{static_cast<int>(std::lround(u)),
                                          static_cast<int>(std::lround(v))};
          if (std::exchange(pixels[i], pixel) == pixel) continue;
          const long x = std::lround(u + noise(random));
          const long y = std::lround(v + noise(random));
          if (x < 0 || y < 0 || x >= camera.model.width || y >= camera.model.height) continue;
          events.push_back(
              {t_ns, static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(y), polarities[i]});
        }
      }
    }
    return sample;
  }
};

}  // namespace efm::test
