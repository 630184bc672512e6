// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>

#include "mapping/geometry/trajectory.h"
#include "tracking_stub/faults/keyframe_noise.h"
#include "tracking_stub/faults/pose_drift.h"
#include "tracking_stub/faults/pose_source.h"

namespace efm {

/// Errors of a tracker's poses. The default is none.
struct PosePerturbationOptions {
  /// Independent noise of each pose: standard deviation on each axis.
  double noise_m = 0;    ///< Of the position, 0 to 1e3.
  double noise_rad = 0;  ///< Of the rotation, 0 to 3.2.
  KeyframeNoiseOptions keyframe;
  PoseDriftOptions drift;
  /// Poses are not interpolated across longer gaps. See TrajectoryOptions.
  double max_pose_gap_s = TrajectoryOptions().max_pose_gap_s;
  std::int64_t tick_ns = 1;  ///< Stamps are multiples of it, 1 to 999999.
  std::uint64_t seed = 0;

  bool any() const;  ///< Whether any error is enabled.
  void validate() const;
};

/// A tracker with errors. Drift, noise per keyframe and noise per pose are added to another
/// source's poses, in this order. Each has its own random numbers. Noise per pose is drawn by
/// stamp: a pose keeps its noise when other poses are lost. The noise of a position is in the world
/// frame, that of a rotation about the rig's axes.
///
/// Noise per keyframe moves all poses of an interval rigidly. The depth map of a window inside the
/// interval does not change. Where an interval begins, two interpolated poses are inserted: one a
/// tick before the jump and one after it. So interpolation does not carry the jump into an
/// interval.
///
/// A pose that is not finite, or has a time beyond kEndOfTimeNs, is returned unchanged.
class PerturbedPoses : public PoseSource {
 public:
  PerturbedPoses(std::unique_ptr<PoseSource> source, const PosePerturbationOptions& options);

  /// @throws std::invalid_argument where the source's pose is older than the one before it.
  std::optional<StampedPose> next() override;
  bool ended() const override { return ready_.empty() && source_->ended(); }

 private:
  /// A pose without noise, and its noise.
  struct NoisyPose {
    std::int64_t t_ns = 0;
    Rigid3 T_world_rig;
    Rigid3 noise;
  };

  void perturb(const StampedPose& pose);
  Rigid3 drawNoise(std::int64_t t_ns) const;
  void insertJumps(const NoisyPose& pose);
  void enterInterval(std::int64_t interval, const NoisyPose& pose);
  void append(const NoisyPose& pose);

  std::unique_ptr<PoseSource> source_;
  PosePerturbationOptions options_;
  PoseDrift drift_;
  std::optional<KeyframeNoise> keyframe_noise_;  // made at the first pose
  std::optional<NoisyPose> before_;              // the previous pose
  std::int64_t interval_ = 0;                    // of the previous pose
  Rigid3 error_;                                 // of that interval
  std::deque<StampedPose> ready_;
};

}  // namespace efm
