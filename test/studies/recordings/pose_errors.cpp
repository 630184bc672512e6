// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/recordings/pose_errors.h"

#include <Eigen/Geometry>

#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"
#include "tracking_stub/random/random_numbers.h"

namespace efm::studies {

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
    const Eigen::Quaterniond turned = rotationBy(errors.drift_rad_s * elapsed_s * every_axis);
    drifted_m += turned * (T_world_rig.translation - true_m);
    true_m = T_world_rig.translation;
    StampedPose pose{t_ns + errors.late_ns, {}};
    pose.T_world_rig.translation = drifted_m + errors.drift_m_s * elapsed_s * every_axis +
                                   errors.noise_m * normalVector(random);
    pose.T_world_rig.rotation =
        (turned * T_world_rig.rotation * rotationBy(errors.noise_rad * normalVector(random)))
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

}  // namespace efm::studies
