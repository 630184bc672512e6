// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "mapping/geometry/rig.h"
#include "tracking_stub/rendering/pixel_rays.h"
#include "tracking_stub/rendering/scene_view.h"
#include "tracking_stub/scenes/scene.h"

namespace efm {

/// The image of a camera at one time.
struct Frame {
  cv::Mat1f log_intensity;
  cv::Mat1i surface;  ///< Index at the pixel's centre; -1 where there is none.
};

/// Renders a scene through a camera without aliasing. Within a surface the texture is blurred. At a
/// silhouette, where an adjacent pixel has another surface, a pixel averages over its area.
class FrameRenderer {
 public:
  /// @throws std::invalid_argument where the model is not valid.
  explicit FrameRenderer(const CameraModel& model) : rays_(model) {}

  const PixelRays& rays() const { return rays_; }

  /// The view for `render` and `sourceOf`.
  SceneView viewFrom(const Scene& scene, const Rigid3& T_world_cam) const {
    return SceneView(scene, T_world_cam, rays_.bounds());
  }

  /// Uses the threads of the caller's oneTBB arena. The result does not depend on them.
  /// @param frame reused where it has the right size.
  void render(const SceneView& view, Frame& frame) const;

  /// The surface point that causes a change of brightness at a pixel: the point at its centre. On a
  /// silhouette it is the nearest point within the pixel, because the edge is on the front surface.
  SurfacePoint sourceOf(const SceneView& view, const Frame& frame, int x, int y) const;

 private:
  void castRow(const SceneView& view, int y, Frame& frame) const;
  void averageSilhouettes(const SceneView& view, int y, Frame& frame) const;

  PixelRays rays_;
};

}  // namespace efm
