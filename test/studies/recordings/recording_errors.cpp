// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/recordings/recording_errors.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "mapping/geometry/timestamp.h"

namespace efm::studies {
namespace {

constexpr double kTwoPi = 6.283185307179586;

Eigen::Vector3d sines(double turns, const Eigen::Vector3d& rates, double phase) {
  Eigen::Vector3d values;
  for (int i = 0; i < 3; ++i) values[i] = std::sin(kTwoPi * turns * rates[i] + phase + i);
  return values;
}

bool earlier(const Event& a, const Event& b) { return a.t_ns < b.t_ns; }

}  // namespace

Recording withPoseSway(const Recording& recording, const PoseSway& sway) {
  Recording swayed = recording;
  swayed.trajectory = Trajectory();
  for (StampedPose pose : recording.trajectory.poses()) {
    const double turns =
        sway.frequency_hz * secondsBetween(recording.simulation.start_ns, pose.t_ns);
    pose.T_world_rig.translation += sway.amplitude_m * sines(turns, {1, 1.3, 0.8}, 0);
    const Eigen::Vector3d turn = sway.amplitude_rad * sines(turns, {0.9, 1.1, 1}, 0.5);
    if (turn.norm() > 0) {
      pose.T_world_rig.rotation =
          (pose.T_world_rig.rotation * Eigen::AngleAxisd(turn.norm(), turn.normalized()))
              .normalized();
    }
    swayed.trajectory.add(pose);
  }
  return swayed;
}

Recording withTurnedCamera(const Recording& recording, std::size_t camera, double turn_rad) {
  Recording turned = recording;
  Rigid3& T_rig_cam = turned.simulation.rig.cameras.at(camera).T_rig_cam;
  T_rig_cam.rotation =
      (T_rig_cam.rotation * Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitY())).normalized();
  return turned;
}

Recording withNoise(const Recording& recording, const EventNoiseOptions& noise) {
  Recording noisy = recording;
  const Simulation& simulation = recording.simulation;
  for (std::size_t c = 0; c < noisy.events.size(); ++c) {
    const CameraModel& model = simulation.rig.cameras[c].model;
    EventNoise source(model.width, model.height, noise,
                      {simulation.seed * 1024 + c, simulation.start_ns});
    std::vector<Event>& events = noisy.events[c];
    const auto clean = static_cast<std::ptrdiff_t>(events.size());
    for (int y = 0; y < model.height; ++y) source.fireRow(y, simulation.endNs(), events);
    std::stable_sort(events.begin() + clean, events.end(), earlier);
    std::inplace_merge(events.begin(), events.begin() + clean, events.end(), earlier);
  }
  return noisy;
}

}  // namespace efm::studies
