// SPDX-License-Identifier: BSD-3-Clause
#include "tracking_stub/rendering/depth_rendering.h"

#include "tracking_stub/rendering/scene_view.h"

namespace efm {

cv::Mat1f renderDepth(const Scene& scene, const Rigid3& T_world_cam, const ReferenceView& view) {
  const RayBounds bounds = {view.pointAt(-0.5, -0.5, 1).head<2>(),
                            view.pointAt(view.width - 0.5, view.height - 0.5, 1).head<2>()};
  const SceneView scene_view(scene, T_world_cam, bounds);
  cv::Mat1f depth(view.height, view.width, 0.0F);
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      const ViewHit hit = scene_view.cast(view.pointAt(x, y, 1).head<2>());
      if (hit.surface >= 0) depth(y, x) = static_cast<float>(1 / hit.inverse_depth);
    }
  }
  return depth;
}

}  // namespace efm
