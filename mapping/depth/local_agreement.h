// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "mapping/depth/sparse_mask.h"

namespace efm {

/// A pixel's depth compared with the depths around it, in 9x9 pixels.
struct LocalAgreement {
  float median = 0;  ///< Weighted median of the positions, its own included; planes.
  float spread = 0;  ///< Median distance of the positions from `median`; planes.
  /// Weighted fraction of the other pixels with a position near its own, 0 to 1. The weight falls
  /// with the distance in the image.
  float agreeing_fraction = 0;
};

/// @param positions of the mask's pixels, in planes. @param weights above 0.
/// @param near positions closer than this agree, planes.
/// @return one per pixel of the mask. Runs on the threads of the task arena that it is called in.
std::vector<LocalAgreement> localAgreement(const SparseMask& mask,
                                           const std::vector<float>& positions,
                                           const std::vector<float>& weights, float near);

}  // namespace efm
