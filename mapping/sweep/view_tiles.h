// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core/types.hpp>
#include <vector>

#include "mapping/geometry/reference_view.h"

namespace efm {

/// The view cut into rectangles of nearly the same size, at most `most_pixels` on a side: row by
/// row, without gap or overlap.
std::vector<cv::Rect> tilesOf(const ReferenceView& view, int most_pixels);

}  // namespace efm
