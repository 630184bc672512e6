// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "mapping/base/named_choice.h"
#include "mapping/base/option.h"
#include "mapping/events/window.h"
#include "mapping/geometry/trajectory.h"

namespace efm {

/// The windows whose motion is corrected.
enum class MotionCorrectionUse {
  kNever,   ///< "false"
  kAlways,  ///< "true"
  kAuto,    ///< Where the poses blur the events: see `BlurWatch`. Needs several cameras.
};

template <>
inline constexpr NamedChoice<MotionCorrectionUse> kNamesOf<MotionCorrectionUse>[] = {
    {MotionCorrectionUse::kNever, "false"},
    {MotionCorrectionUse::kAlways, "true"},
    {MotionCorrectionUse::kAuto, "auto"}};

/// Correction of the motion within a window. Trackers wander by some per cent of their travel
/// within tenths of a second. A window then has a wrong motion, which blurs the DSI. The correction
/// is the motion along which short slices of events lie on the edges of the depth map; it is kept
/// if the fused DSI becomes sharper (Ghosh and Gallego 2022, Sec. 3.4.2, interpret DSIs as images
/// of warped events). The pose at the reference time stays, so the keyframe keeps its pose.
///
/// The correction needs several cameras: the depth of a single camera fits a wrong motion.
struct MotionCorrectionOptions {
  MotionCorrectionUse correct_motion = MotionCorrectionUse::kNever;
  /// Standard deviations of the tracker's velocity error on each axis, within one slice. The
  /// correction expects at least these errors, and errors of half the speed. They keep the
  /// correction near 0 if the events do not determine it. Above 0, at most 10 m/s and 1000 degrees
  /// per second.
  double motion_sigma_m_s = 0.05;
  double motion_sigma_deg_s = 5;
  /// Maximum number of rounds: each estimates the motion from the depth, then the depth from the
  /// motion. A round takes about twice as long as a keyframe without correction. 1 to 10. Rounds
  /// end when the motion no longer changes.
  int motion_rounds = 3;
  /// Fraction by which the sharpness of the fused DSI must grow before a correction is accepted: a
  /// smaller gain may be chance. 0 to 1.
  double min_gain = 0.02;

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("correct_motion", self.correct_motion);
    visit("motion_sigma_m_s", self.motion_sigma_m_s,
          Allowed::above(0, 10, "above 0 and at most 10"));
    visit("motion_sigma_deg_s", self.motion_sigma_deg_s,
          Allowed::above(0, 1000, "above 0 and at most 1000"));
    visit("motion_rounds", self.motion_rounds, Allowed::from(1, 10, "1 to 10"));
    visit("min_gain", self.min_gain, Allowed::from(0, 1, "0 to 1").notInFiles());
  }
  void validate() const { requireFields(*this); }
};

/// Returns the knots of a window's correction, all 0: one at the reference time, and others at most
/// `spacing_s` apart. The outermost one lies at the end that is farther from the reference time,
/// none lies beyond: poses outside the window may not be here yet, or no more.
MotionCorrection knotsOf(const Window& window, double spacing_s);
/// Returns the time of a knot, inside the window or at its end.
std::int64_t timeOfKnot(const MotionCorrection& correction, std::size_t knot, const Window& window);

/// Returns the corrected motion during a window. In [t0, t1) it has poses at the times of
/// `trajectory`, and at the knots.
/// @param trajectory has a pose at the reference time.
Trajectory correctedTrajectory(const Trajectory& trajectory, const Window& window,
                               const MotionCorrection& correction);

/// Decides from the blur of some windows whether the poses blur them: by the median of the last
/// three. It looks at the first window and then at each eighth, and at the next one after a blur.
struct BlurWatch {
  /// Returns whether the poses blur the windows.
  bool isOn() const;
  /// Returns whether the next window is to be looked at.
  bool isDue() const;
  /// Adds a window.
  /// @param blur_px by how much the poses blur its events, pixels; std::nullopt: not looked at, or
  /// not known.
  /// @param finest_px see AlignedMotion: a blur is judged in these pixels.
  void add(std::optional<double> blur_px, double finest_px = 1);
  /// Replaces the blur of the last window that was looked at by a better value.
  void setLast(double blur_px, double finest_px = 1) { last_px.front() = blur_px / finest_px; }

  std::vector<double> last_px;  ///< Of the finest edges; the newest first.
  int since_look = 0;           ///< Number of windows.
};

/// The part of a window around its reference time, with its events.
struct CentralPart {
  Window window;
  std::vector<CameraEvents> cameras;

  /// @param fraction of the window, above 0, at most 1.
  CentralPart(const WindowInput& input, double fraction);
  WindowInput input(const WindowInput& of_window) const {
    return {window, cameras, of_window.view, of_window.planes, of_window.T_world_ref};
  }
};

}  // namespace efm
