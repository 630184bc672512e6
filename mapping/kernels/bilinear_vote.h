// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

namespace efm::kernels {

/// The votes of one camera on one depth plane: row-major, width x height, owned by the caller.
struct VotePlane {
  float* votes = nullptr;
  int width = 0;
  int height = 0;
};

/// Rays as two arrays of pixel coordinates on the plane that transfers start from.
struct RayArrays {
  const float* x = nullptr;
  const float* y = nullptr;
};

/// Rays [begin, end) meet the plane at (scale * x + offset_x, scale * y + offset_y).
struct RayTransfer {
  std::size_t begin = 0;
  std::size_t end = 0;
  float scale = 0;
  float offset_x = 0;
  float offset_y = 0;
};

/// Adds one bilinear vote per ray to the plane, where all four neighbouring pixels lie inside it:
/// 0 <= x < width - 1 and 0 <= y < height - 1. The plain scalar kernel: the specification.
/// @return the number of votes cast.
std::uint64_t voteBilinear(const RayArrays& rays, const RayTransfer& transfer,
                           const VotePlane& plane);

}  // namespace efm::kernels
