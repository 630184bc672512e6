// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <optional>
#include <vector>

#include "mapping/base/named_choice.h"
#include "mapping/base/option.h"
#include "mapping/geometry/rig.h"

namespace efm {

enum class PlaneSpacing {
  kInverse,  ///< Uniform in inverse depth: equal steps of disparity.
  kLinear,   ///< Uniform in depth.
};

template <>
inline constexpr NamedChoice<PlaneSpacing> kNamesOf<PlaneSpacing>[] = {
    {PlaneSpacing::kInverse, "inverse"},
    {PlaneSpacing::kLinear, "linear"},
};

/// Smallest depth of a plane, metres.
inline constexpr double kMinDepthM = 1e-3;

struct DepthPlanesOptions {
  double min_depth_m = 0.5;  ///< Depth of the nearest plane, above 0.
  double max_depth_m = 5.0;  ///< Depth of the farthest plane, above `min_depth_m`.
  int num_planes = 100;      ///< At least 1; a single plane lies at `min_depth_m`.
  PlaneSpacing spacing = PlaneSpacing::kInverse;

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    // Rejects non-finite and non-positive depths first: `validate` has narrower limits.
    visit("min_depth_m", self.min_depth_m,
          Allowed::above(0, Allowed::kFinite, "finite and above 0"));
    visit("max_depth_m", self.max_depth_m,
          Allowed::above(0.001, Allowed::kFinite, "finite and above 0.001"));
    visit("num_planes", self.num_planes, Allowed::from(1, 100'000, "1 to 100000"));
    visit("spacing", self.spacing);
  }
  void validate() const;
};

/// The planes of the DSI, parallel to the image of the reference view. Plane 0 is the nearest. The
/// depths of the first and the last plane are exactly the two limits.
class DepthPlanes {
 public:
  explicit DepthPlanes(const DepthPlanesOptions& options = {});

  int size() const { return static_cast<int>(depths_.size()); }
  /// Returns the depth of a plane in metres.
  double depth(int plane) const { return depths_[static_cast<std::size_t>(plane)]; }
  /// Returns the depth in metres at a position from 0 (nearest plane) to size() - 1 (farthest).
  double depthAt(double position) const;
  /// Returns the difference of the two nearest planes in inverse depth, 1/m; 0 if there is one
  /// plane. With inverse spacing all neighbouring planes have this difference.
  double inverseDepthStep() const;
  /// Returns the inverse depth step around a position (0 to size() - 1), 1/m.
  double inverseDepthStepAt(double position) const;

 private:
  DepthPlanesOptions options_;
  std::vector<double> depths_;
};

/// The undistorted pinhole view of a keyframe's DSI and depth map. Frame `ref`: x right, y down, z
/// forward. Images are row-major, width x height; integer coordinates are pixel centres.
struct ReferenceView {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< Pixels.

  /// Returns a camera's view without distortion: the same size and intrinsics.
  static ReferenceView of(const CameraModel& model) {
    return {model.width, model.height, model.fx, model.fy, model.cx, model.cy};
  }

  std::size_t pixels() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }

  Eigen::Vector2d project(const Eigen::Vector3d& p_ref) const {
    return {fx * p_ref.x() / p_ref.z() + cx, fy * p_ref.y() / p_ref.z() + cy};
  }
  /// Returns the point at z-depth `depth_m` (metres) on the ray of pixel (x, y), frame `ref`.
  Eigen::Vector3d pointAt(double x, double y, double depth_m) const {
    return {(x - cx) / fx * depth_m, (y - cy) / fy * depth_m, depth_m};
  }
};

struct ReferenceViewOptions {
  /// Horizontal field of view in degrees, above 0 and below 180. Pixels keep the camera's aspect
  /// ratio, and the principal point is the image's centre. Not given: the camera's own intrinsics.
  std::optional<double> fov_deg;
  /// Size in pixels, 1 to 65,535 each, at most 2^26 pixels in all. Not given: the camera's size. If
  /// only one side is given, the camera's aspect ratio determines the other side.
  std::optional<int> width;
  std::optional<int> height;
  /// Shift along the view's own axes (x right, y down, z forward), metres.
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();

  template <typename Self, typename Visit>
  static void fields(Self& self, Visit&& visit) {
    visit("fov_deg", self.fov_deg, Allowed::above(0, 180, "above 0 and below 180").below());
    visit("width", self.width, Allowed::from(1, 65'535, "1 to 65535"));
    visit("height", self.height, Allowed::from(1, 65'535, "1 to 65535"));
    visit("rv_offset_m", self.offset_m);
  }
  void validate() const;
};

/// Returns a camera's view without distortion, with the field of view and size of the options. If a
/// size is given but no field of view, the view shows the camera's image at another resolution.
ReferenceView makeReferenceView(const CameraModel& model, const ReferenceViewOptions& options);

/// Rays from one camera centre that all run forward or all run backward along the reference view's
/// z axis: the events of a pose packet.
struct RayPacket {
  std::size_t begin = 0;                                 ///< Index of the first ray.
  std::size_t end = 0;                                   ///< One past the index of the last ray.
  Eigen::Vector3d center_ref = Eigen::Vector3d::Zero();  ///< Camera centre C, frame `ref`, metres.
  bool forward = true;                                   ///< True if the rays run towards larger z.
};

/// The pixels where a packet's rays meet one plane: x = scale * x_inf + offset_x, likewise y.
/// (x_inf, y_inf) is the pixel where a ray meets the plane at infinity.
struct PlaneTransfer {
  double scale = 0;
  double offset_x = 0;
  double offset_y = 0;
  bool in_front = false;  ///< True if the plane lies ahead of the event camera along its rays.
};

/// Returns the transfer of a packet's rays to the plane at depth `depth_m`: the second step of
/// Rebecq et al. (IJCV 2018, Eq. 15) with the plane at infinity as Z0. x(Z) = (1 - C_z/Z) x_inf +
/// (f C_x + c C_z) / Z, where C is the camera centre, and f and c are the view's fx and cx.
PlaneTransfer transferToPlane(const RayPacket& packet, const ReferenceView& view, double depth_m);

}  // namespace efm
