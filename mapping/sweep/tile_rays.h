// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "mapping/dsi/plane_values.h"
#include "mapping/kernels/tile_scatter.h"

namespace efm {

/// The rays that one tile sees of one `RayBins` in a group of planes. Keeps its memory.
class TileRays {
 public:
  void clear() { size_ = 0; }
  std::size_t size() const { return size_; }

  /// Makes room for more rays, which a kernel may write behind those that are there.
  void reserve(std::size_t more);
  /// Takes what a kernel wrote.
  void resize(std::size_t size) { size_ = size; }
  /// Takes a ray that does not move, into room that is there.
  void add(float x, float y);
  /// Fills up the last vector with rays that no tile sees.
  void pad();

  kernels::TileRays view() { return {x_.data(), y_.data(), dx_.data(), dy_.data(), size_}; }

 private:
  PlaneValues x_, y_, dx_, dy_;
  std::size_t size_ = 0;
};

}  // namespace efm
