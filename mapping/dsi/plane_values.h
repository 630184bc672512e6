// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <tbb/cache_aligned_allocator.h>

#include <algorithm>
#include <cassert>
#include <opencv2/core.hpp>
#include <vector>

namespace efm {

/// One value per pixel of a plane or of a tile of it, row-major. Begins on a cache line, so that
/// no vector lies in two lines.
template <typename Value>
using PixelValues = std::vector<Value, tbb::cache_aligned_allocator<Value>>;
using PlaneValues = PixelValues<float>;

/// Writes the values of a tile into its part of an image.
template <typename Value>
void writeTo(cv::Mat_<Value> part, const PixelValues<Value>& values) {
  assert(values.size() == part.total());
  auto row = values.begin();
  for (int y = 0; y < part.rows; ++y, row += part.cols) std::copy_n(row, part.cols, part[y]);
}

}  // namespace efm
