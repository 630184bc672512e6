// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/depth/depth_extraction.h"

namespace efm {

/// `ExtractionMethod::kAggregated`. The paper takes any peak that stands out from its neighbours in
/// the image, however flat it is along the ray and whatever its neighbours say. Here:
/// 1. Look at the pixels whose confidence exceeds its Gaussian surroundings by `min_excess`.
/// 2. Sum the rays of those around each (`aggregateRays`); the peak of the sum is its depth.
/// 3. Take the median of the depths in 9x9 pixels, weighted by the excess.
/// 4. Quality: the excess, less where the summed ray has a second peak nearly as high or is flat
/// (an
///    edge along the motion has no depth), where the median differs, and where few of the
///    neighbours agree. Keep where it is above `min_quality`.
/// 5. Variance from the width of the peak and the scatter of depths around the pixel.
/// Peaks on the first and the last plane are not kept where there are planes between: what lies
/// beyond the planes peaks there.
/// @param dsi with rays, picked in a window of `threshold_kernel`.
DepthMap extractAggregated(const SweptDsi& dsi, const DepthPlanes& planes,
                           const DepthExtractionOptions& options);

}  // namespace efm
