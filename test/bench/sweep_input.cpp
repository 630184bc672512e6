// SPDX-License-Identifier: BSD-3-Clause
#include "test/bench/sweep_input.h"

#include <cstddef>

#include "mapping/geometry/lens.h"
#include "mapping/rays/rays.h"

namespace efm::bench {

SweepInput makeSweepInput(const SyntheticWindow& made, int planes) {
  DepthPlanesOptions options = made.options.planes;
  options.num_planes = planes;
  const RigCamera& reference = made.rig.cameras.front();
  SweepInput input{ReferenceView::of(reference.model), DepthPlanes(options), {}, {}};
  const Rigid3 T_world_ref = *made.trajectory.poseAt(made.window.t_ref_ns) * reference.T_rig_cam;
  const PacketGeometry geometry{T_world_ref.inverse(), input.view, input.planes.depth(0),
                                input.planes.depth(planes - 1)};
  for (std::size_t c = 0; c < made.events.size(); ++c) {
    const RigCamera& camera = made.rig.cameras[c];
    const UndistortionTable undistortion(camera.model);
    const PosePackets& packets = input.packets.emplace_back(splitIntoPosePackets(
        made.events[c], camera, undistortion, made.trajectory, geometry, made.options.packets));
    input.cameras.push_back({backProject(made.events[c], packets, undistortion, input.view)});
  }
  return input;
}

}  // namespace efm::bench
