// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "mapping/keyframes/keyframe_depth_map.h"
#include "test/studies/recordings/recording_cache.h"

namespace efm::studies {

/// The pixels of a keyframe's view that could have points: their surface points fired in the
/// window, at least once in each camera and three times on average. Points hidden from the view do
/// not count.
/// @param truth_m true z-depth of the view.
cv::Mat1b visibleEdges(const Recording& recording, const KeyframeDepthMap& keyframe,
                       const cv::Mat1f& truth_m);

}  // namespace efm::studies
