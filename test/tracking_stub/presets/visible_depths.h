// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <limits>

#include "tracking_stub/rendering/frame_renderer.h"
#include "tracking_stub/sensor/simulated_rig.h"

namespace efm::test {

/// The z-depths that a camera sees during a simulation.
struct VisibleDepths {
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = 0;
  double sky = 0;  ///< Fraction of the rays that hit nothing.
};

/// Casts every fifth ray in x and y, at 11 times.
inline VisibleDepths visibleDepths(const Simulation& simulation, const RigCamera& camera) {
  VisibleDepths depths;
  const PixelRays rays(camera.model);
  int cast = 0;
  int missed = 0;
  for (int i = 0; i <= 10; ++i) {
    const std::int64_t t_ns = simulation.start_ns + simulation.duration_ns * i / 10;
    const SceneView view(simulation.scene, simulation.motion->poseAt(t_ns) * camera.T_rig_cam,
                         rays.bounds());
    for (int y = 0; y < rays.height(); y += 5) {
      for (int x = 0; x < rays.width(); x += 5) {
        const ViewHit hit = view.cast(rays(x, y).ray);
        ++cast;
        if (hit.surface < 0) {
          ++missed;
          continue;
        }
        depths.nearest = std::min(depths.nearest, 1 / hit.inverse_depth);
        depths.farthest = std::max(depths.farthest, 1 / hit.inverse_depth);
      }
    }
  }
  depths.sky = static_cast<double>(missed) / cast;
  return depths;
}

}  // namespace efm::test
