// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core/types.hpp>
#include <vector>

#include "mapping/event_contrast.h"
#include "mapping/velocity_correction.h"
#include "mapping/warped_events.h"

namespace efm {

/// Inside the keyframe: a tracker's jitter makes its motion within a window wrong, which blurs the
/// DSI. The mean velocity by which it is wrong is found as the one that makes the images of warped
/// events sharpest (contrast maximisation: Gallego et al., CVPR 2018), events being warped to the
/// depths that were mapped without a correction.
struct MotionCorrectionOptions {
  bool correct_motion = false;
  /// Standard deviations on each axis of the velocity that the tracker is wrong by: how far a
  /// correction is looked for. Above 0, at most 10 m/s and 10 rad/s.
  double sigma_m_s = 0.05;
  double sigma_rad_s = 0.09;
  /// Events that are warped, of all cameras together: more take longer. 100 to 10,000,000.
  int max_events = 20000;
  /// Times that depth and velocity are found, one from the other. 1 to 10.
  int rounds = 2;
  /// Share by which the contrast of the fused DSI must grow for a correction to be taken: less is
  /// what a correction of exact poses would gain by chance. 0 to 1.
  double min_gain = 0.01;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// What a correction is looked for with.
struct SharpestMotionInput {
  cv::Size view;
  /// Standard deviation of the depths that events were warped to, 1/m.
  double sigma_inverse_depth = 0;
  /// The correction that events were warped with.
  VelocityCorrection warped_with;
};

/// The correction that makes the events of all cameras sharpest; what says nothing of it leaves it
/// near none. Bounded in time by the number of events.
/// @return that of the input where there are no events.
VelocityCorrection sharpestMotion(const std::vector<std::vector<WarpedEvent>>& events,
                                  const SharpestMotionInput& input,
                                  const MotionCorrectionOptions& options);

}  // namespace efm
