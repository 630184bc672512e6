// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>

#include "mapping/geometry/trajectory.h"
#include "tracking_stub/faults/keyframe_noise.h"
#include "tracking_stub/faults/pose_drift.h"
#include "tracking_stub/poses/pose_source.h"

namespace efm {

/// What may be wrong with a tracker's poses. The default is nothing.
struct PosePerturbationOptions {
  double noise_m = 0;    ///< Of each pose on its own, standard deviation on each axis; 0 to 1e3.
  double noise_rad = 0;  ///< The same of its rotation, 0 to 3.2.
  KeyframeNoiseOptions keyframe;
  PoseDriftOptions drift;
  /// Across longer gaps poses are not interpolated. As TrajectoryOptions has it.
  double max_pose_gap_s = TrajectoryOptions().max_pose_gap_s;
  std::int64_t tick_ns = 1;  ///< What stamps are multiples of, 1 to 999999.
  std::uint64_t seed = 0;

  /// Whether a pose would change.
  bool any() const;
  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// A tracker that errs: another source's poses after drift, then noise per keyframe, then noise per
/// pose, whose draws do not depend on each other. Noise per pose is drawn by stamp, so that a pose
/// keeps its own when others are lost; positions err in the world, rotations about the rig's axes.
///
/// Noise per keyframe moves all of a stretch rigidly: depth maps of a window inside it stay as they
/// are. Where one begins, two poses are put in that lie on the way from the pose before to the one
/// after, one a tick before the jump and one behind it, so that interpolation keeps it out of both
/// stretches.
///
/// A pose that is not finite, or has a time beyond kEndOfTimeNs, passes as it is.
class PerturbedPoses : public PoseSource {
 public:
  /// @throws std::invalid_argument where the options are not valid or there is no source.
  PerturbedPoses(std::unique_ptr<PoseSource> source, const PosePerturbationOptions& options);

  /// @throws std::invalid_argument where the source's pose is older than the one before it.
  std::optional<StampedPose> next() override;
  bool ended() const override { return ready_.empty() && source_->ended(); }

 private:
  /// A pose before noise, and the noise that it will have.
  struct NoisyPose {
    std::int64_t t_ns = 0;
    Rigid3 T_world_rig;
    Rigid3 noise;
  };

  void take(const StampedPose& pose);
  Rigid3 drawNoise(std::int64_t t_ns) const;
  void passJumps(const NoisyPose& pose);
  void enterStretch(std::int64_t stretch, const NoisyPose& pose);
  void give(const NoisyPose& pose);

  std::unique_ptr<PoseSource> source_;
  PosePerturbationOptions options_;
  PoseDrift drift_;
  std::optional<KeyframeNoise> keyframe_noise_;  // from the first pose on, where asked for
  std::optional<NoisyPose> before_;
  std::int64_t stretch_ = 0;  // the one that the pose before is in
  Rigid3 error_;              // there
  std::deque<StampedPose> ready_;
};

}  // namespace efm
