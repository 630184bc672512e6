// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include <functional>
#include <vector>

#include "mapping/base/option.h"
#include "mapping/events/window.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/motion/event_contrast.h"

namespace efm {

/// Options of `minimise`.
struct QuasiNewtonOptions {
  int max_evaluations = 60;
  double first_step = 0.1;  ///< Length of the first trial step, in the variables' unit.
  double min_step = 1e-4;   ///< A shorter step ends the search.
};

/// Finds the minimum of a smooth function by the method of Broyden, Fletcher, Goldfarb and Shanno,
/// with a line search that halves its steps (Nocedal and Wright, Numerical Optimization, 2006, Alg.
/// 6.1). It suits few variables of about the same scale.
/// @param function returns its value (infinite outside its domain), and sets the gradient.
/// @return the best position found; never worse than the start.
Eigen::VectorXd minimise(
    const std::function<double(const Eigen::VectorXd&, Eigen::VectorXd&)>& function,
    const Eigen::VectorXd& start, const QuasiNewtonOptions& options = {});

/// Correction of the motion within a window. A tracker that jitters gives a window a wrong motion,
/// which blurs the DSI. The velocity error is taken as constant within the window. The correction
/// is the one with the sharpest images of warped events (contrast maximization: Gallego et al.,
/// CVPR 2018; Ghosh and Gallego 2022, Sec. 3.4.2, interpret DSIs as these images).
///
/// The correction needs several cameras: the images of a single camera are sharp also for a wrong
/// motion with wrong depths. It is for trackers with errors within a window; it does not improve
/// exact poses.
struct MotionCorrectionOptions {
  bool correct_motion = false;
  /// Standard deviations of the tracker's velocity error on each axis; they keep the correction
  /// near 0 if the events do not determine it. Above 0, at most 10 m/s and 1000 degrees per second.
  double motion_sigma_m_s = 0.05;
  double motion_sigma_deg_s = 5;
  /// Number of rounds: each estimates the velocity from the depth, then the depth from the
  /// velocity. A round takes two to three times as long as a keyframe without correction. 1 to 10.
  /// The second round finds most of the remaining error.
  int motion_rounds = 2;
  /// Maximum number of warped events, of all cameras together; more events take longer. 100 to
  /// 10,000,000.
  int max_events = 20000;
  /// Fraction by which the sharpness of the fused DSI must grow before a correction is accepted: a
  /// smaller gain may be chance. 0 to 1.
  double min_gain = 0.01;

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("correct_motion", self.correct_motion);
    visit("motion_sigma_m_s", self.motion_sigma_m_s,
          Allowed::above(0, 10, "above 0 and at most 10"));
    visit("motion_sigma_deg_s", self.motion_sigma_deg_s,
          Allowed::above(0, 1000, "above 0 and at most 1000"));
    visit("motion_rounds", self.motion_rounds, Allowed::from(1, 10, "1 to 10"));
    visit("max_events", self.max_events, Allowed::from(100, 1e7, "100 to 10,000,000").notInFiles());
    visit("min_gain", self.min_gain, Allowed::from(0, 1, "0 to 1").notInFiles());
  }
  void validate() const { requireFields(*this); }
};

/// Finds the correction that makes the events of all cameras sharpest, given the depth that was
/// found along a motion. Runs on the threads of the caller's task arena.
/// @param motion the tracker's motion, corrected by `current`.
/// @param depth of the view, found along `motion`, metres; 0: no depth.
/// @return `current` if the events do not determine a correction.
VelocityCorrection findCorrection(const WindowInput& input, const Trajectory& motion,
                                  const cv::Mat1f& depth, const VelocityCorrection& current,
                                  const MotionCorrectionOptions& options);

struct ContrastSearch {
  cv::Size view;
  /// Standard deviation of the depth that the events were warped to, 1/m.
  double sigma_inverse_depth = 0;
  /// The correction that the events were warped with.
  VelocityCorrection current;
};

/// Finds the correction that maximizes the contrast of the warped events of all cameras.
/// @return `search.current` if there are no events.
VelocityCorrection maximizeContrast(const std::vector<std::vector<WarpedEvent>>& events,
                                    const ContrastSearch& search,
                                    const MotionCorrectionOptions& options);

}  // namespace efm
