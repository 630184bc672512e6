// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include <cstddef>
#include <limits>
#include <vector>

#include "mapping/geometry/reference_view.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/rigid3.h"
#include "tracking_stub/scenes/scene.h"

namespace efm {

/// Bounds of the viewing rays (X/Z, Y/Z), frame `cam`.
struct RayBounds {
  Eigen::Vector2d min = {-1, -1};
  Eigen::Vector2d max = {1, 1};
};

/// The surface that a camera ray hits, and its inverse z-depth (1/m). -1 and 0 if there is none.
struct ViewHit {
  int surface = -1;
  double inverse_depth = 0;
};

/// A scene seen from one pose, for casting the rays of all pixels.
///
/// On a plane, the inverse depth and the plane's coordinates over depth are linear in the ray
/// (X/Z, Y/Z). So a rectangle is represented by three linear functions, and finding a hit needs no
/// division. The bounds are divided into tiles. A tile lists its visible surfaces, nearest first.
/// Rays outside of the bounds are slower. Queries are thread-safe.
class SceneView {
 public:
  /// @param scene must outlive the view.
  SceneView(const Scene& scene, const Rigid3& T_world_cam, const RayBounds& bounds = {});

  /// Returns the first surface on the ray (X/Z, Y/Z). A ray of NaN hits no surface.
  ViewHit cast(const Eigen::Vector2d& ray) const;

  /// Returns the surface point of this ray's hit.
  SurfacePoint surfacePointOf(const ViewHit& hit, const Eigen::Vector2d& ray) const;

  /// Returns the log intensity of this ray's hit, blurred with a standard deviation of half a
  /// pixel. It is 0 if the ray hits nothing.
  /// @param pixel_pitch size of a pixel in units of the ray: about 1/f.
  float logIntensity(const ViewHit& hit, const Eigen::Vector2d& ray, double pixel_pitch) const;

 private:
  // The vectors are coefficients of X/Z, Y/Z and 1.
  struct Facet {
    int surface;
    Eigen::Vector3d inverse_depth;
    Eigen::Vector3d u_over_depth;
    Eigen::Vector3d v_over_depth;
    double width_m, height_m;
  };
  struct Candidate {
    int facet;
    double max_inverse_depth;  // in its tile
  };

  void fillTile(const Eigen::Vector2d& center, const Eigen::Vector2d& half_size,
                std::vector<Candidate>& tile) const;
  const std::vector<Candidate>& tileOf(const Eigen::Vector2d& ray) const;
  const Facet& facetOf(const ViewHit& hit) const {
    return facets_[static_cast<std::size_t>(facet_of_[static_cast<std::size_t>(hit.surface)])];
  }

  const Scene* scene_;
  RayBounds bounds_;
  Eigen::Vector2d tiles_per_ray_;
  std::vector<Facet> facets_;                  // only the visible sides
  std::vector<int> facet_of_;                  // index per surface; -1 if not visible
  std::vector<std::vector<Candidate>> tiles_;  // row-major; the last is for rays out of the bounds
};

/// The viewing ray (X/Z, Y/Z) of a raw pixel's centre, and its change across the pixel. The ray is
/// NaN if the pixel lies outside the lens: such a pixel is dark.
struct PixelRay {
  Eigen::Vector2d ray = Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  Eigen::Vector2d per_x = ray;  ///< Change of the ray per pixel to the right.
  Eigen::Vector2d per_y = ray;  ///< Change of the ray per pixel down.
  double pitch = 0;             ///< Size of the pixel in units of the ray.

  /// Returns the ray of a point in the pixel. The offsets from the centre are -0.5 to 0.5 pixels.
  Eigen::Vector2d at(double dx, double dy) const { return ray + dx * per_x + dy * per_y; }
};

/// The viewing rays of all pixels of a camera, with distortion.
class PixelRays {
 public:
  explicit PixelRays(const CameraModel& model);

  int width() const { return width_; }
  int height() const { return height_; }
  const PixelRay& operator()(int x, int y) const {
    return rays_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                 static_cast<std::size_t>(x)];
  }
  /// Returns the bounds of all rays of all pixels.
  const RayBounds& bounds() const { return bounds_; }

 private:
  int width_;
  int height_;
  std::vector<PixelRay> rays_;  // row-major
  RayBounds bounds_;
};

/// The image of a camera at one time.
struct Frame {
  cv::Mat1f log_intensity;
  cv::Mat1i surface;  ///< Index of the surface at the pixel's centre; -1 if there is none.
};

/// Renders a scene through a camera without aliasing. Within a surface the texture is blurred. A
/// pixel at a silhouette (an adjacent pixel has another surface) is the average over its area.
class FrameRenderer {
 public:
  explicit FrameRenderer(const CameraModel& model) : rays_(model) {}

  const PixelRays& rays() const { return rays_; }

  /// Returns the view for `render` and `sourceOf`.
  SceneView viewFrom(const Scene& scene, const Rigid3& T_world_cam) const {
    return SceneView(scene, T_world_cam, rays_.bounds());
  }

  /// Renders a frame in the caller's oneTBB arena. The result does not depend on its threads.
  /// @param frame its memory is reused if it has the right size.
  void render(const SceneView& view, Frame& frame) const;

  /// Returns the surface point that causes a change of brightness at a pixel: the point seen at the
  /// pixel's centre. On a silhouette it is the nearest point within the pixel.
  SurfacePoint sourceOf(const SceneView& view, const Frame& frame, int x, int y) const;

 private:
  void castRow(const SceneView& view, int y, Frame& frame) const;
  void averageSilhouettes(const SceneView& view, int y, Frame& frame) const;

  PixelRays rays_;
};

/// Returns the exact depth map of a scene: z-depth in metres on the ray through each pixel's
/// centre, 0 if the ray hits nothing.
cv::Mat1f renderDepth(const Scene& scene, const Rigid3& T_world_cam, const ReferenceView& view);

}  // namespace efm
