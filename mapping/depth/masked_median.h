// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "mapping/depth/sparse_mask.h"

namespace efm {

/// For each kept pixel the lower median of the values of the kept pixels in the window around it,
/// itself included: of n values in order the one at (n - 1) / 2.
///
/// Cost: per pixel the window's side, not its area, and next to nothing for pixels that are not
/// kept; memory: 20 bytes per kept pixel while it runs.
/// @param values one per kept pixel, not NaN.
/// @param window side in pixels, odd.
std::vector<float> maskedMedian(const SparseMask& kept, const std::vector<float>& values,
                                int window);

}  // namespace efm
