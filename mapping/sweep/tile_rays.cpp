// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/tile_rays.h"

namespace efm {

void TileRays::reserve(std::size_t more) {
  const std::size_t needed = size_ + more + kernels::kRayPadding;
  if (x_.size() >= needed) return;
  for (PlaneValues* values : {&x_, &y_, &dx_, &dy_}) values->resize(needed + needed / 2);
}

void TileRays::add(float x, float y) {
  x_[size_] = x;
  y_[size_] = y;
  dx_[size_] = dy_[size_] = 0;
  ++size_;
}

void TileRays::pad() {
  reserve(0);
  for (std::size_t i = size_; i < size_ + kernels::kRayPadding; ++i) {
    x_[i] = y_[i] = -1;  // left of and above every cell
    dx_[i] = dy_[i] = 0;
  }
}

}  // namespace efm
