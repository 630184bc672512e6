// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/motion/motion_correction.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

constexpr std::size_t kWatched = 3;  // windows
constexpr int kLookEvery = 8;
// Looks at windows of simulated desks, rooms and streets, 9 of 10: exact poses up to 0.3, of a
// street up to 0.4; good hand-held trackers 0.35 and more, typical ones 0.75, a car's 1.4. In the
// pixels of the finest edges; at 1280 x 720, where these are twice as large, exact poses up to 0.3,
// good trackers 1.
constexpr double kBlurPx = 0.4;

}  // namespace

bool BlurWatch::isOn() const {
  std::vector<double> sorted = last_px;
  std::sort(sorted.begin(), sorted.end());
  return !sorted.empty() && sorted[sorted.size() / 2] >= kBlurPx;
}

bool BlurWatch::isDue() const {
  return last_px.empty() || last_px.front() >= kBlurPx || since_look + 1 >= kLookEvery;
}

void BlurWatch::add(std::optional<double> blur_px, double finest_px) {
  ++since_look;
  if (!blur_px) return;
  since_look = 0;
  last_px.insert(last_px.begin(), *blur_px / finest_px);
  if (last_px.size() > kWatched) last_px.pop_back();
}

MotionCorrection knotsOf(const Window& window, double spacing_s) {
  constexpr double kRounding = 1e-6;
  const double before_s = std::max(0.0, secondsBetween(window.t0_ns, window.t_ref_ns));
  const double after_s = std::max(0.0, secondsBetween(window.t_ref_ns, window.t1_ns));
  const double longer_s = std::max(before_s, after_s);
  MotionCorrection knots;
  knots.spacing_s = longer_s / std::max(1.0, std::ceil(longer_s / spacing_s - kRounding));
  const auto spacings = [&](double length_s) {
    return static_cast<std::size_t>(std::floor(length_s / knots.spacing_s + kRounding));
  };
  knots.reference = spacings(before_s);
  knots.knots.assign(knots.reference + spacings(after_s) + 1, Vector6d::Zero());
  return knots;
}

std::int64_t timeOfKnot(const MotionCorrection& correction, std::size_t knot,
                        const Window& window) {
  const std::int64_t t_ns = window.t_ref_ns + durationFromSeconds(correction.sinceReference(knot));
  return std::clamp(t_ns, std::min(window.t0_ns, window.t_ref_ns),
                    std::max(window.t1_ns, window.t_ref_ns));
}

Trajectory correctedTrajectory(const Trajectory& trajectory, const Window& window,
                               const MotionCorrection& correction) {
  const std::int64_t from_ns = std::min(window.t0_ns, window.t_ref_ns);
  const std::int64_t to_ns = std::max(window.t1_ns, window.t_ref_ns);
  Trajectory corrected = trajectory.moved(from_ns, to_ns, [&](const StampedPose& pose) {
    const double since_s = secondsBetween(window.t_ref_ns, pose.t_ns);
    return pose.T_world_rig * correction.displacement(since_s);
  });
  // Between two moved poses, interpolation would miss the knots.
  corrected.add({window.t_ref_ns, trajectory.poseAt(window.t_ref_ns).value()});
  for (std::size_t i = 0; i < correction.knots.size(); ++i) {
    const std::int64_t t_ns = timeOfKnot(correction, i, window);
    const std::optional<Rigid3> T_world_rig = trajectory.poseAt(t_ns);
    if (!T_world_rig) continue;
    corrected.add({t_ns, *T_world_rig * correction.displacement(correction.sinceReference(i))});
  }
  return corrected;
}

CentralPart::CentralPart(const WindowInput& input, double fraction) : window(input.window) {
  const auto towards = [&](std::int64_t t_ns) {
    const double length_ns = static_cast<double>(t_ns - window.t_ref_ns);
    return window.t_ref_ns + static_cast<std::int64_t>(fraction * length_ns);
  };
  window.t0_ns = towards(window.t0_ns);
  window.t1_ns = towards(window.t1_ns);
  cameras = input.cameras;
  for (CameraEvents& camera : cameras) {
    camera.events = camera.events.between(window.t0_ns, window.t1_ns);
  }
}

}  // namespace efm
