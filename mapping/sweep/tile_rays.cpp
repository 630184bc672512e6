// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/tile_rays.h"

#include <cassert>

namespace efm {
namespace {

int roundDown(int value, int unit) { return value / unit * unit; }

}  // namespace

TileCells::TileCells(const cv::Rect& tile_pixels, const ReferenceView& view) : tile(tile_pixels) {
  assert(tile.width <= kMaxPixels && tile.height <= kMaxPixels);
  // A pixel has cells on its left and above it; the view has none beyond its last pixels.
  all = {tile.x - 1, tile.y - 1, tile.width + 1, tile.height + 1};
  in_view = all & cv::Rect(0, 0, view.width - 1, view.height - 1);
  if (in_view.empty()) in_view = {};
  origin = {roundDown(in_view.x, kernels::kSharedOrigin),
            roundDown(in_view.y, kernels::kSharedOrigin)};
}

void TileRays::reserve(std::size_t more) {
  const std::size_t needed = size_ + more + kernels::kRayPadding;
  if (x_.size() >= needed) return;
  for (PlaneValues* values : {&x_, &y_, &dx_, &dy_}) values->resize(needed + needed / 2);
}

void TileRays::pad() {
  reserve(0);
  for (std::size_t i = size_; i < size_ + kernels::kRayPadding; ++i) {
    x_[i] = y_[i] = -1;  // left of and above every cell
    dx_[i] = dy_[i] = 0;
  }
}

}  // namespace efm
