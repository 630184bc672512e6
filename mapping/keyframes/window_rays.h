// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mapping/events/event_groups.h"
#include "mapping/events/window_input.h"
#include "mapping/geometry/trajectory.h"
#include "mapping/keyframes/keyframe_depth_map.h"
#include "mapping/rays/back_projection.h"
#include "mapping/rays/pose_packets.h"

namespace efm {

/// The rays of one camera's events of a window, and counts of its events.
struct WindowRays {
  int camera = 0;                         ///< Index in the rig.
  CameraRays rays;                        ///< One bundle per part of `EventGroups`.
  std::uint64_t events = 0;               ///< With a ray.
  std::uint64_t without_pose = 0;         ///< Without a ray.
  std::uint64_t outside_lens = 0;         ///< Without a ray, with a pose.
  std::uint64_t silent_subintervals = 0;  ///< Sub-intervals (of all slices) without a ray.
};

/// Back-projects one camera's events along a trajectory, part by part (Ghosh and Gallego 2022,
/// Algorithm 2, line 3).
/// @param camera one of the input's cameras.
WindowRays raysOf(const CameraEvents& camera, const WindowInput& input,
                  const Trajectory& trajectory, const EventGroups& groups,
                  const PosePacketsOptions& packets);

/// Counts the events of all cameras of a keyframe.
void countEvents(const std::vector<WindowRays>& cameras, KeyframeDepthMap& keyframe);
/// Removes the cameras without rays, unless no camera has any.
void removeSilent(std::vector<WindowRays>& cameras);
/// The inputs of the fusion; consumes the cameras' rays.
std::vector<CameraRays> inputsOf(std::vector<WindowRays>& cameras, const FusionLayout& layout);

}  // namespace efm
