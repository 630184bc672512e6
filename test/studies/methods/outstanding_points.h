// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "mapping/depth/depth_extraction.h"

namespace efm::studies {

/// The `count` pixels with the highest local contrast: confidence minus its 5x5 Gaussian mean. More
/// pixels where contrasts are equal; all pixels where there are fewer.
/// @param among 0 excludes a pixel.
cv::Mat1b mostOutstanding(const DepthMap& map, const cv::Mat1b& among, int count);

/// The depths at the pixels of a mask; 0 elsewhere.
cv::Mat1f only(const cv::Mat1f& depth, const cv::Mat1b& mask);

}  // namespace efm::studies
