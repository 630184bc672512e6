// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "mapping/base/named_choice.h"
#include "mapping/geometry/rigid3.h"
#include "mapping/geometry/trajectory.h"

namespace efm {

/// Classes of real trackers, by the error of the motion within 0.2 s in per cent of the travel.
enum class TrackerClass {
  kNone,     ///< Exact poses.
  kGood,     ///< Hand-held, 3 %.
  kTypical,  ///< Hand-held, 13 %.
  kPoor,     ///< Fast or shaken, 27 %.
  kCar,      ///< Driving, 3 %.
};

template <>
inline constexpr NamedChoice<TrackerClass> kNamesOf<TrackerClass>[] = {
    {TrackerClass::kNone, "none"},
    {TrackerClass::kGood, "good"},
    {TrackerClass::kTypical, "typical"},
    {TrackerClass::kPoor, "poor"},
    {TrackerClass::kCar, "car"}};

struct TrackerProcessOptions {
  TrackerClass tracker = TrackerClass::kNone;
  /// Middle depth of the scene, metres; default 2. At this depth the errors of translation and
  /// rotation cancel in the image.
  std::optional<double> depth_m;
  Rigid3 T_body_cam;  ///< A camera on the tracked body; the errors are those of its motion.

  bool any() const { return tracker != TrackerClass::kNone; }
};

/// Returns the poses of a tracker that makes the errors of real event-based trackers, resampled at
/// their median rate, but at most 100 times a second. Gaps stay.
///
/// The error of the camera's position is a random walk that leaks back to 0, as a tracker returns
/// to its own map: de/dt = u - e / tau. Its velocity u is in proportion to the camera's speed, and
/// comes in bursts. The error of the rotation keeps the image aligned at `depth_m`. Scale and
/// direction of the travel wander; each pose has a little noise of its own. The parameters were
/// fitted to the estimates of published trackers and the truth of 16 recordings.
/// @param poses in time order.
/// @param max_pose_gap_s see TrajectoryOptions.
/// @param tick_ns time stamps are multiples of this, from the first one.
/// @throws std::invalid_argument if there are fewer than two poses, or a pose is not finite.
std::vector<StampedPose> withTrackerProcess(const std::vector<StampedPose>& poses,
                                            const TrackerProcessOptions& options,
                                            double max_pose_gap_s, std::int64_t tick_ns,
                                            std::uint64_t seed);

}  // namespace efm
