// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/keyframes/window_rays.h"

#include <algorithm>
#include <cstddef>
#include <utility>

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
  PolaritySplit split;
  for (const EventPart& part : groups.partsOf(camera.events, input.window)) {
    const EventSpan events = part.select(split);
    const PosePackets packets = splitIntoPosePackets(
        events, *camera.calibration, *camera.undistortion, trajectory, geometry, options);
    const RayBundle& rays =
        result.rays.emplace_back(backProject(events, packets, *camera.undistortion, input.view));
    result.events += rays.size();
    result.without_pose += packets.without_pose;
    result.outside_lens += events.size() - packets.without_pose - rays.size();
    rays_in[part.subinterval] += rays.size();
  }
  result.silent_subintervals =
      static_cast<std::uint64_t>(std::count(rays_in.begin(), rays_in.end(), std::size_t{0}));
  return result;
}

void countEvents(const std::vector<WindowRays>& cameras, KeyframeDepthMap& keyframe) {
  for (const WindowRays& camera : cameras) {
    keyframe.events[static_cast<std::size_t>(camera.camera)] = camera.events;
    keyframe.without_pose += camera.without_pose;
    keyframe.outside_lens += camera.outside_lens;
    if (camera.events == 0) {
      keyframe.silent_cameras.push_back(camera.camera);
    } else {
      keyframe.silent_subintervals += camera.silent_subintervals;
    }
  }
}

void removeSilent(std::vector<WindowRays>& cameras) {
  const auto silent = [](const WindowRays& camera) { return camera.events == 0; };
  if (std::all_of(cameras.begin(), cameras.end(), silent)) return;
  cameras.erase(std::remove_if(cameras.begin(), cameras.end(), silent), cameras.end());
}

std::vector<CameraRays> inputsOf(std::vector<WindowRays>& cameras, const FusionLayout& layout) {
  std::vector<CameraRays> inputs;
  for (const auto& slots : layout.inputs) {
    CameraRays& input = inputs.emplace_back();
    for (const auto& slot : slots) input.push_back(std::move(cameras[slot.camera].rays[slot.part]));
  }
  return inputs;
}

}  // namespace efm
