// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/events/window.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"

namespace efm::test {

/// Random input of every kind that the mapping takes, from one seed.
class RandomScene {
 public:
  explicit RandomScene(std::uint32_t seed) : random_(seed) {}

  double uniform(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random_);
  }

  /// Draws a pose up to `distance_m` from the origin on each axis, rotated by up to `angle_rad`.
  Rigid3 pose(double distance_m, double angle_rad) {
    const Eigen::Vector3d axis(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
    return {
        Eigen::Quaterniond(Eigen::AngleAxisd(uniform(-angle_rad, angle_rad), axis.normalized())),
        Eigen::Vector3d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)) * distance_m};
  }

  /// Draws a hand-held motion with a pose every 5 ms. Speeds are in metres and radians per second.
  Trajectory motion(std::int64_t t0_ns, double duration_s, double speed_m_s,
                    double rotation_rad_s) {
    constexpr double kStep_s = 0.005;
    Trajectory trajectory;
    Rigid3 T_world_rig = pose(0.1, 0.1);
    for (int i = 0; i * kStep_s <= duration_s + kStep_s; ++i) {
      trajectory.add({t0_ns + i * 5'000'000, T_world_rig});
      T_world_rig = T_world_rig * pose(speed_m_s * kStep_s, rotation_rad_s * kStep_s);
    }
    return trajectory;
  }

  /// Draws events on the whole sensor, in time order over [t0, t0 + duration).
  std::vector<Event> events(const CameraModel& model, std::size_t count, std::int64_t t0_ns,
                            std::int64_t duration_ns) {
    std::vector<std::int64_t> times(count);
    for (auto& t_ns : times) {
      t_ns = t0_ns + std::uniform_int_distribution<std::int64_t>(0, duration_ns - 1)(random_);
    }
    std::sort(times.begin(), times.end());
    std::vector<Event> events;
    for (const std::int64_t t_ns : times) {
      events.push_back({t_ns, pixel(model.width), pixel(model.height), uniform(0, 1) < 0.5});
    }
    return events;
  }

 private:
  std::uint16_t pixel(int side) {
    return static_cast<std::uint16_t>(std::uniform_int_distribution<int>(0, side - 1)(random_));
  }

  std::mt19937 random_;
};

inline CameraModel smallCamera() {
  return {48, 36, 31.0, 31.5, 23.2, 17.8, DistortionModel::kRadtan, {-0.14, 0.09, 0.0003, 0.0002}};
}

/// Returns a camera whose lens folds over: pixels more than 17 px from the centre have no ray.
inline CameraModel foldingCamera() {
  CameraModel model = smallCamera();
  model.coefficients = {-0.5, 0, 0.0003, 0.0002};
  return model;
}

/// Random events of some moving cameras during one window.
struct RandomRecording {
  static constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'001;
  static constexpr std::int64_t kDuration_ns =
      100'000'007;  // not divisible by the number of sub-intervals
  static constexpr Window kWindow{kStart_ns, kStart_ns + kDuration_ns,
                                  kStart_ns + kDuration_ns / 2};

  Rig rig;
  Trajectory trajectory;
  std::vector<std::vector<Event>> events;  // per camera

  RandomRecording(std::uint32_t seed, int cameras, std::size_t events_per_camera) {
    RandomScene random(seed);
    trajectory = random.motion(kStart_ns, 0.11, 2.0, 2.0);
    for (int c = 0; c < cameras; ++c) {
      rig.cameras.push_back({smallCamera(), random.pose(0.1, 0.1), 0});
      events.push_back(random.events(smallCamera(), events_per_camera, kStart_ns, kDuration_ns));
    }
  }

  std::vector<int> cameras() const {
    std::vector<int> all;
    for (std::size_t c = 0; c < events.size(); ++c) all.push_back(static_cast<int>(c));
    return all;
  }
  std::vector<EventSpan> spans() const { return {events.begin(), events.end()}; }
};

}  // namespace efm::test
