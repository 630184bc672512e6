// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/window_rays.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace efm {

WindowRays raysOf(const CameraEvents& camera, const WindowInput& input,
                  const Trajectory& trajectory, const EventGroups& groups,
                  const PosePacketsOptions& options) {
  const DepthPlanes& planes = input.planes;
  const PacketGeometry geometry{input.T_world_ref.inverse(), input.view, planes.depth(0),
                                planes.depth(planes.size() - 1)};
  WindowRays result;
  result.camera = camera.camera;
  std::vector<std::size_t> rays_in(groups.subintervals());
  std::vector<Event> of_polarity;  // reused
  for (const EventPart& part : groups.partsOf(camera.events, input.window)) {
    const EventSpan events = part.select(of_polarity);
    const PosePackets packets = splitIntoPosePackets(
        events, *camera.calibration, *camera.undistortion, trajectory, geometry, options);
    const RayBundle& rays =
        result.rays.emplace_back(backProject(events, packets, *camera.undistortion, input.view));
    result.events += rays.size();
    result.without_pose += packets.without_pose;
    rays_in[part.subinterval] += rays.size();
  }
  result.silent_subintervals =
      static_cast<std::uint64_t>(std::count(rays_in.begin(), rays_in.end(), std::size_t{0}));
  return result;
}

}  // namespace efm
