// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "mapping/depth/depth_extraction.h"

namespace efm {

/// `ExtractionMethod::kAggregated`. The paper takes every peak with enough contrast in the image,
/// even if the peak is flat along the ray or its neighbours disagree. Here:
/// 1. Select the pixels whose local contrast is above `min_local_contrast`. Local contrast:
///    confidence minus its Gaussian mean in a window, over the mean confidence of the keyframe.
/// 2. Sum the DSI columns around each (`aggregateColumns`); the peak of the sum is its first depth.
/// 3. The depth of a pixel is the median of the first depths in 9x9 pixels, weighted by local
///    contrast (`localAgreement`).
/// 4. Quality: the local contrast, lowered where the summed column has a second peak nearly as high
///    or is flat (an edge along the motion has no depth), where the first depth differs from the
///    median, and where few neighbours agree. Keep the pixel if it is above `min_quality`.
/// 5. Variance from the width of the peak and the spread of the depths around the pixel.
/// Peaks on the first and the last plane are not kept if there are planes between them: points
/// beyond the planes peak there.
/// @param dsi with columns, selected in a window of `threshold_kernel`.
/// @param parallax_px_m see `KeyframeFacts`.
DepthMap extractAggregated(const SweptDsi& dsi, const DepthPlanes& planes,
                           const DepthExtractionOptions& options,
                           double parallax_px_m = KeyframeFacts{}.parallax_px_m);

}  // namespace efm
