// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "mapping/geometry/camera.h"
#include "tracking_stub/rendering/pixel_rays.h"
#include "tracking_stub/rendering/scene_view.h"
#include "tracking_stub/scenes/scene.h"

namespace efm {

/// What a camera's pixels see at one instant.
struct Frame {
  cv::Mat1f log_intensity;
  cv::Mat1i surface;  ///< At the pixel's centre; -1 where nothing.
};

/// Renders a scene through a camera. Within a surface the texture's own blur keeps the image free
/// of aliasing; a pixel whose neighbourhood holds another surface averages over its area, so that a
/// silhouette sweeps smoothly across it.
class FrameRenderer {
 public:
  /// @throws std::invalid_argument where the model is not valid.
  explicit FrameRenderer(const CameraModel& model) : rays_(model) {}

  const PixelRays& rays() const { return rays_; }

  /// A view for `render` and `sourceOf`.
  SceneView viewFrom(const Scene& scene, const Rigid3& T_world_cam) const {
    return SceneView(scene, T_world_cam, rays_.bounds());
  }

  /// Uses the threads of the caller's oneTBB arena; the result does not depend on them.
  /// @param frame reused where it has the size already.
  void render(const SceneView& view, Frame& frame) const;

  /// What a change of brightness at a pixel came from: the place at its centre, and on a silhouette
  /// the nearest place within the pixel, for the edge belongs to the surface in front.
  SurfacePoint sourceOf(const SceneView& view, const Frame& frame, int x, int y) const;

 private:
  void castRow(const SceneView& view, int y, Frame& frame) const;
  void averageSilhouettes(const SceneView& view, int y, Frame& frame) const;

  PixelRays rays_;
};

}  // namespace efm
