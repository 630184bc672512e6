// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/recordings/recording_errors.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "tracking_stub/random/random_numbers.h"

namespace efm::studies {
namespace {

Eigen::Vector3d sines(double cycles, const Eigen::Vector3d& rates, double phase) {
  Eigen::Vector3d values;
  for (int i = 0; i < 3; ++i) values[i] = std::sin(2 * kPi * cycles * rates[i] + phase + i);
  return values;
}

bool earlier(const Event& a, const Event& b) { return a.t_ns < b.t_ns; }

}  // namespace

Recording withPoseSway(const Recording& recording, const PoseSway& sway) {
  Recording swayed = recording;
  swayed.trajectory = Trajectory();
  for (StampedPose pose : recording.trajectory.poses()) {
    const double cycles =
        sway.frequency_hz * secondsBetween(recording.simulation.start_ns, pose.t_ns);
    pose.T_world_rig.translation += sway.amplitude_m * sines(cycles, {1, 1.3, 0.8}, 0);
    const Eigen::Vector3d rotation = sway.amplitude_rad * sines(cycles, {0.9, 1.1, 1}, 0.5);
    if (rotation.norm() > 0) {
      pose.T_world_rig.rotation =
          (pose.T_world_rig.rotation * Eigen::AngleAxisd(rotation.norm(), rotation.normalized()))
              .normalized();
    }
    swayed.trajectory.add(pose);
  }
  return swayed;
}

Recording withPoseErrors(const Recording& recording, const PoseErrors& errors) {
  Recording wrong = recording;
  wrong.trajectory = Trajectory();
  RandomNumbers random(errors.seed);
  const Eigen::Vector3d every_axis = Eigen::Vector3d::Ones();
  const Motion& motion = *recording.simulation.motion;
  const std::int64_t start_ns = recording.simulation.start_ns;
  const std::int64_t end_ns = recording.simulation.endNs();
  Eigen::Vector3d true_m = motion.poseAt(start_ns).translation;
  Eigen::Vector3d drifted_m = true_m;
  for (std::int64_t t_ns = start_ns; t_ns <= end_ns; t_ns += errors.period_ns) {
    const Rigid3 T_world_rig = motion.poseAt(t_ns);
    const double elapsed_s = secondsBetween(start_ns, t_ns);
    const Eigen::Quaterniond drift = rotationBy(errors.drift_rad_s * elapsed_s * every_axis);
    drifted_m += drift * (T_world_rig.translation - true_m);
    true_m = T_world_rig.translation;
    StampedPose pose{t_ns + errors.late_ns, {}};
    pose.T_world_rig.translation = drifted_m + errors.drift_m_s * elapsed_s * every_axis +
                                   errors.noise_m * normalVector(random);
    pose.T_world_rig.rotation =
        (drift * T_world_rig.rotation * rotationBy(errors.noise_rad * normalVector(random)))
            .normalized();
    wrong.trajectory.add(pose);
  }
  return wrong;
}

Recording withLateCamera(const Recording& recording, std::size_t camera, std::int64_t late_ns) {
  Recording wrong = recording;
  for (Event& event : wrong.events.at(camera)) event.t_ns += late_ns;
  return wrong;
}

Recording withRotatedCamera(const Recording& recording, std::size_t camera, double angle_rad) {
  Recording wrong = recording;
  Rigid3& T_rig_cam = wrong.simulation.rig.cameras.at(camera).T_rig_cam;
  T_rig_cam.rotation =
      (T_rig_cam.rotation * Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitY())).normalized();
  return wrong;
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
