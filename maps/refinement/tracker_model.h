// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "mapping/base/option.h"
#include "mapping/geometry/rigid3.h"
#include "maps/refinement/pose_refinement.h"
#include "maps/refinement/refinement_state.h"
#include "maps/refinement/registration_points.h"

namespace efm {

/// A motion between two keyframes by the tracker, compared with the motion by their points.
struct MotionSample {
  Vector6d difference = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Identity();  ///< Covariance of the latter motion; not singular.
  double path_length_m = 0;                    ///< Path length between the two keyframes.
  NoiseScale from = {};
  NoiseScale to = {};
};

/// Returns the most likely errors, given the samples and the expected errors. Their prior is
/// lognormal: one standard deviation is a factor of ten for noise, and of two for drift. The prior
/// of drift is tighter because few samples do not show drift, and a drift of 0 would bend every
/// loop. Few samples change little. Cost: a few hundred 6 x 6 decompositions per sample.
TrackerErrors estimateTrackerErrors(const std::vector<MotionSample>& samples,
                                    const TrackerErrors& expected);

/// A keyframe with a refined pose.
struct RefinedKeyframe {
  RegistrationCloud cloud;
  Rigid3 T_odom_ref;             ///< Pose by the tracker, whose world may drift.
  Rigid3 T_world_ref;            ///< Refined pose.
  Rigid3 T_world_ref_denoised;   ///< The pose of the tracker without noise, in the refined world.
  double path_length_m = 0;      ///< Path from the first keyframe, by the tracker.
  NoiseScale noise_scale = {};   ///< Noise of its pose by the tracker.
  std::size_t first_factor = 0;  ///< No factor before this index has the keyframe.
  bool moved = true;             ///< True if it moved since `takeMoved`.
};

/// The errors of the tracker, learnt from the registrations of its keyframes.
class TrackerModel {
 public:
  /// @param adapt whether the errors are learnt; otherwise they are the expected errors.
  TrackerModel(const TrackerErrors& expected, bool adapt)
      : expected_(expected), errors_(expected), adapt_(adapt) {}

  /// The estimated errors.
  const TrackerErrors& errors() const { return errors_; }
  /// Returns the errors for registrations: at least a fraction of the expected errors, because a
  /// tracker that was exact may become worse.
  TrackerErrors cautious() const;
  /// Returns the errors for pose graphs: with the drift that loops have shown.
  TrackerErrors inGraph() const;

  /// Returns the scale of a noise that the tracker states for one pose.
  NoiseScale scaleOf(const std::optional<PoseNoise>& stated) const;

  /// Adds the difference between the motions of the tracker and of a registration.
  /// @param from, to the keyframes of the factor.
  void addSample(const RelativePoseFactor& factor, const RefinedKeyframe& from,
                 const RefinedKeyframe& to);
  /// Estimates the errors from the last samples.
  void update() {
    if (adapt_) errors_ = estimateTrackerErrors({samples_.begin(), samples_.end()}, expected_);
  }
  /// Multiplies the drift in pose graphs, up to a limit.
  /// @return whether it was below the limit.
  bool increaseDrift();

 private:
  TrackerErrors expected_;
  TrackerErrors errors_;
  bool adapt_;
  double drift_factor_ = 1;
  std::deque<MotionSample> samples_;
};

}  // namespace efm
