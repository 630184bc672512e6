// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "mapping/depth/depth_extraction.h"
#include "mapping/geometry/reference_view.h"

namespace efm::oracle {

/// `extractAggregated` written down as simply as possible, in double precision and from the whole
/// DSI: every step looks at every pixel, no ray is rounded and none is left out.
/// @param dsi [plane][row][column]. Without dilation.
/// @param step_planes the unit of distances between peaks; parabolas go through the next planes.
DepthMap extractAggregated(const std::vector<float>& dsi, const cv::Size& size,
                           const DepthPlanes& planes, const DepthExtractionOptions& options,
                           double step_planes);

}  // namespace efm::oracle
