// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "mapping/back_projection.h"
#include "mapping/depth_planes.h"
#include "mapping/kernels/ray_samples.h"
#include "mapping/plane_values.h"
#include "mapping/reference_view.h"

namespace efm {

/// Rays without their packets, by patch of the image: what those of a patch meet on a plane lies
/// together in memory.
///
/// A packet's transfer (see `RayBundle`), written by ray: x(q) = x_inf + q (f C_x + c C_z - C_z
/// x_inf) with the inverse depth q = 1/Z.
class ImageOrderedRays {
 public:
  /// The rays of several bundles; those of a patch stay in the bundles' order.
  ImageOrderedRays(const std::vector<const RayBundle*>& bundles, const ReferenceView& view,
                   const DepthPlanes& planes);

  /// How many patches a view has: whatever the rays.
  std::size_t patches() const { return begin_.size() - 1; }
  /// Those halfway between the nearest and the farthest plane in a patch, or beside the view next
  /// to it, and as many that meet nothing as make them a multiple of `kernels::kRayBlock`.
  kernels::SlopedRays patch(std::size_t index) const;

 private:
  std::vector<std::size_t> begin_;  // by patch, and the end
  PixelValues<float> x_;
  PixelValues<float> y_;
  PixelValues<float> dx_;
  PixelValues<float> dy_;
  PixelValues<float> limit_;
};

}  // namespace efm
