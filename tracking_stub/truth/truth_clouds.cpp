// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/truth/truth_clouds.h"

#include <algorithm>

#include "tracking_stub/rendering/pixel_rays.h"
#include "tracking_stub/rendering/scene_view.h"
#include "tracking_stub/truth/surface_cells.h"

namespace efm {
namespace {

constexpr std::uint32_t kMinEvents = 3;
/// The rays of one view miss some cells. The views of the moving camera together see them.
constexpr std::int64_t kViewPeriodNs = 20'000'000;

void addVisibleCells(const Scene& scene, const PixelRays& rays, const Rigid3& T_world_cam,
                     SurfaceCells& seen) {
  const SceneView view(scene, T_world_cam, rays.bounds());
  for (int y = 0; y < rays.height(); ++y) {
    for (int x = 0; x < rays.width(); ++x) {
      const Eigen::Vector2d& ray = rays(x, y).ray;
      seen.add(view.surfacePointOf(view.cast(ray), ray));
    }
  }
}

}  // namespace

TruthClouds makeTruthClouds(const Simulation& simulation,
                            const std::vector<CameraRecording>& recordings) {
  SurfaceCells seen(simulation.scene, simulation.truth_cell_m);
  SurfaceCells fired(simulation.scene, simulation.truth_cell_m);
  for (const RigCamera& camera : simulation.rig.cameras) {
    const PixelRays rays(camera.model);
    for (std::int64_t t_ns = simulation.start_ns; t_ns <= simulation.endNs();
         t_ns += kViewPeriodNs) {
      addVisibleCells(simulation.scene, rays, simulation.motion->poseAt(t_ns) * camera.T_rig_cam,
                      seen);
    }
  }
  for (const CameraRecording& recording : recordings) {
    for (const SurfacePoint& source : recording.sources) {
      seen.add(source);
      fired.add(source);
    }
  }
  return {seen.centers(1), fired.centers(kMinEvents)};
}

}  // namespace efm
