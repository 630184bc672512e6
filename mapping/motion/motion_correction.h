// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core/types.hpp>
#include <vector>

#include "mapping/motion/event_contrast.h"
#include "mapping/motion/velocity_correction.h"
#include "mapping/motion/warped_events.h"

namespace efm {

/// A tracker that jitters gives a window a motion that is wrong, which blurs the DSI. The constant
/// velocity by which it is wrong is the one that makes the images of warped events sharpest
/// (contrast maximisation: Gallego et al., CVPR 2018; Ghosh and Gallego 2022, Sec. 3.4.2, see the
/// DSI as such images).
///
/// For several cameras: a single one sees a wrong motion as well with wrong depths, and little is
/// found. For trackers that are wrong within a window: exact poses gain nothing.
struct MotionCorrectionOptions {
  bool correct_motion = false;
  /// Standard deviations, on each axis, of the velocity that the tracker is wrong by: what the
  /// events leave open is held near 0 by them. Above 0, at most 10 m/s and 1000 degrees per second.
  double motion_sigma_m_s = 0.05;
  double motion_sigma_deg_s = 5;
  /// How often depth and velocity are found, one from the other; each takes two to three times as
  /// long as the keyframe without. 1 to 10. The second finds most of what the first left.
  int motion_rounds = 2;
  /// Events that are warped, of all cameras together: more take longer. 100 to 10,000,000.
  int max_events = 20000;
  /// Share by which the sharpness of the fused DSI must grow for a correction to be taken: less may
  /// be chance. 0 to 1.
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
