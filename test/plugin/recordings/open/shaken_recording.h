// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <random>
#include <utility>

#include "test/plugin/session/synthetic_recording.h"

namespace efm {

/// What a tracker's poses of the synthetic recording err by: each keyframe's on its own.
struct Shake {
  double noise_m = 0.01;
  double noise_rad = 0.005;
  unsigned seed = 1;
};
inline constexpr std::int64_t kShakenWindowNs = 100'000'000;

/// The recording with poses that err, by the same within each window of 0.1 s.
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

/// Options that suit it: a keyframe in each window, whose poses are refined.
inline EventFusionOptions refinedOptions() {
  EventFusionOptions options = syntheticOptions();
  options.mapper.policy.window_s = 0.1;
  options.mapper.policy.stride_s = 0.1;
  options.cloud.voxel_size_m = 0.02;
  options.refinement.enabled = true;
  return options;
}

}  // namespace efm
