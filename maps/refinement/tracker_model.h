// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <optional>

#include "maps/refinement/pose_refinement.h"
#include "maps/refinement/refined_keyframe.h"
#include "maps/refinement/tracker_errors.h"

namespace efm {

/// The errors of the tracker, learnt from the registrations of its keyframes.
class TrackerModel {
 public:
  /// @param adapt whether the errors are learnt; otherwise they are the expected ones.
  TrackerModel(const TrackerErrors& expected, bool adapt)
      : expected_(expected), errors_(expected), adapt_(adapt) {}

  /// The estimated errors.
  const TrackerErrors& errors() const { return errors_; }
  /// For registrations: at least a fraction of the expected errors, because a tracker that was
  /// exact may become worse.
  TrackerErrors cautious() const;
  /// For pose graphs: with the drift that loops have shown.
  TrackerErrors inGraph() const;

  /// The scale of a noise that the tracker states for one pose.
  NoiseScale scaleOf(const std::optional<PoseNoise>& stated) const;

  /// Adds the difference between the motion of the tracker and that of a registration.
  /// @param from, to the keyframes of the factor.
  void addSample(const RelativePoseFactor& factor, const RefinedKeyframe& from,
                 const RefinedKeyframe& to);
  /// Estimates the errors from the last samples.
  void update();
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
