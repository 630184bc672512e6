// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "mapping/depth/depth_extraction.h"

namespace efm::studies {

/// Of some pixels of a map those that stand out most from their surroundings (confidence less its
/// 5x5 Gaussian mean), so many of them or a few more where they stand out alike; all of them where
/// they are fewer.
/// @param among 0: not one of them.
cv::Mat1b mostOutstanding(const DepthMap& map, const cv::Mat1b& among, int count);

/// The depths of a map at some pixels, 0 elsewhere.
cv::Mat1f only(const cv::Mat1f& depth, const cv::Mat1b& mask);

}  // namespace efm::studies
