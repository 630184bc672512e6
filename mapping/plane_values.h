// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <tbb/cache_aligned_allocator.h>

#include <vector>

namespace efm {

/// What the pixels of a plane, or of a tile of it, have of something: row-major. Begins on a cache
/// line, so that vectors do not straddle two.
template <typename Value>
using PixelValues = std::vector<Value, tbb::cache_aligned_allocator<Value>>;
using PlaneValues = PixelValues<float>;

}  // namespace efm
