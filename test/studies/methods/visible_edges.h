// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "mapping/keyframes/keyframe_depth_map.h"
#include "test/studies/recordings/recording_cache.h"

namespace efm::studies {

/// Where a keyframe could have points: pixels of its view that show what fired in its window, at
/// least once in each camera and on average three times. What was hidden from the view does not
/// count.
/// @param truth_m true z-depth of the view.
cv::Mat1b visibleEdges(const Recording& recording, const KeyframeDepthMap& keyframe,
                       const cv::Mat1f& truth_m);

}  // namespace efm::studies
