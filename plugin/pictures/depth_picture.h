// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "mapping/geometry/depth_planes.h"

namespace efm {

/// A depth map for the eye: red = near to blue = far, even in inverse depth between the two limits;
/// white where there is no depth (0).
/// @return 8-bit BGR, of the map's size.
cv::Mat3b depthPicture(const cv::Mat1f& depth_m, const DepthPlanesOptions& limits);

/// A confidence map for the eye, negated as in Ghosh and Gallego 2022: white = none, black = the
/// map's maximum.
cv::Mat1b confidencePicture(const cv::Mat1f& confidence);

/// Accumulated events for the eye: red where more became brighter than darker, blue where more
/// became darker, grey where as many, white where there was none; strong colours from 3 events on.
/// @param counts per pixel: darker, brighter.
cv::Mat3b eventPicture(const cv::Mat_<cv::Vec2i>& counts);

}  // namespace efm
