// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "mapping/depth/sparse_mask.h"

namespace efm {

/// How a pixel's depth stands among those around it, in 9x9 pixels.
struct LocalAgreement {
  float median = 0;  ///< Of the positions around it, its own included, weighted; planes.
  float spread = 0;  ///< Median distance of these from their median, planes.
  /// Share of the others that are near its own position, weighted, those close by more: 0 to 1.
  float share = 0;
};

/// @param positions of the kept pixels, in planes. @param weights above 0.
/// @param near within so many planes counts as near.
/// @return one per kept pixel. Runs on the threads of the task arena that it is called in.
std::vector<LocalAgreement> localAgreement(const SparseMask& kept, cv::Size size,
                                           const std::vector<float>& positions,
                                           const std::vector<float>& weights, float near);

}  // namespace efm
