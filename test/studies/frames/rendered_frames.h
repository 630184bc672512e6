// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"
#include "test/studies/frames/posed_frames.h"
#include "tracking_stub/scenes/scene.h"

namespace efm::studies {

struct RenderedFramesOptions {
  double grey = 45;       ///< Grey value where log intensity is 0.
  double noise_grey = 0;  ///< Standard deviation of the noise. With noise, values are rounded.
  std::uint64_t seed = 1;
};

/// The undistorted frames of an ordinary camera on a simulated rig.
/// @param poses T_world_cam.
PosedFrames renderedFrames(const Scene& scene, const CameraModel& camera,
                           const std::vector<StampedPose>& poses,
                           const RenderedFramesOptions& options = {});

}  // namespace efm::studies
