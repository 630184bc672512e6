// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <tbb/cache_aligned_allocator.h>
#include <opencv2/core.hpp>

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <vector>

#include "mapping/base/named_choice.h"
#include "mapping/events/event_fate.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/kernels/kernels.h"

namespace efm {

/// One value per pixel of a plane or of a tile of it, row-major. Its memory begins with a cache
/// line, so that no vector crosses two lines.
template <typename Value>
using PixelValues = std::vector<Value, tbb::cache_aligned_allocator<Value>>;
using PlaneValues = PixelValues<float>;

/// Writes the values of a tile, row-major, into its part of an image.
template <typename Value>
void writeTo(cv::Mat_<Value> part, const Value* row) {
  for (int y = 0; y < part.rows; ++y, row += part.cols) std::copy_n(row, part.cols, part[y]);
}

/// The voxels of a DSI: the pixels of the reference view on each depth plane.
struct DsiGrid {
  ReferenceView view;
  DepthPlanes planes;
};

template <>
inline constexpr NamedChoice<VotingKernel> kNamesOf<VotingKernel>[] = {
    {VotingKernel::kPlain, "plain"},   {VotingKernel::kBaseline, "baseline"},
    {VotingKernel::kSse4, "sse4"},     {VotingKernel::kAvx2, "avx2"},
    {VotingKernel::kAvx512, "avx512"}, {VotingKernel::kNeon, "neon"},
};

/// Returns the kernels of this build that this processor can run, plain first.
const std::vector<VotingKernel>& availableKernels();
bool isAvailable(VotingKernel kernel);

/// Returns the fastest of some kernels, or plain. Measured speeds, as multiples of plain's:
/// baseline 0.6 to 1, SSE4 2 to 2.2, AVX2 2.5 to 4.2, AVX-512 2.6 to 4.5 (docs/performance.md).
/// NEON has not been measured: its vectors are as long as SSE4's, and the code is the same.
VotingKernel fastestOf(const std::vector<VotingKernel>& kernels);
/// Returns the fastest of `availableKernels`.
VotingKernel fastestKernel();

}  // namespace efm
