// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>
#include <vector>

namespace efm {

enum class PlaneSpacing {
  kInverse,  ///< Uniform in inverse depth: equal steps of disparity.
  kLinear,   ///< Uniform in depth.
};

std::string_view nameOf(PlaneSpacing spacing);
/// @throws std::invalid_argument naming the value and the known names.
PlaneSpacing planeSpacingFromName(std::string_view name);

/// The nearest plane is at least this far, metres.
inline constexpr double kMinDepthM = 1e-3;

struct DepthPlanesOptions {
  double min_depth_m = 0.5;  ///< Depth of the nearest plane, above 0.
  double max_depth_m = 5.0;  ///< Depth of the farthest plane, above `min_depth_m`.
  int num_planes = 100;      ///< At least 1; a single plane lies at `min_depth_m`.
  PlaneSpacing spacing = PlaneSpacing::kInverse;

  /// @throws std::invalid_argument naming the field, its value and the allowed range.
  void validate() const;
};

/// The planes of the DSI, parallel to the image of the reference view. Plane 0 is the nearest; the
/// first and the last plane are exactly the two limits.
class DepthPlanes {
 public:
  /// @throws std::invalid_argument where the options are not valid.
  explicit DepthPlanes(const DepthPlanesOptions& options = {});

  int size() const { return static_cast<int>(depths_.size()); }
  /// Depth of a plane in metres.
  double depth(int plane) const { return depths_[static_cast<std::size_t>(plane)]; }
  /// Depth at a position between planes: 0 is the nearest plane, size() - 1 the farthest.
  double depthAt(double position) const;
  /// Distance of the two nearest planes in inverse depth, 1/m. Inverse spacing has the same
  /// distance everywhere. 0 with one plane.
  double inverseDepthStep() const;
  /// Distance of neighbouring planes around a position, 1/m. @param position 0 to size() - 1.
  double inverseDepthStepAt(double position) const;

 private:
  DepthPlanesOptions options_;
  std::vector<double> depths_;
};

}  // namespace efm
