// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "mapping/depth/sparse_mask.h"
#include "mapping/geometry/depth_planes.h"

namespace efm {

/// A semi-dense depth map in the reference view.
struct DepthMap {
  cv::Mat1f depth;       ///< z-depth in metres; 0 where there is none.
  cv::Mat1f confidence;  ///< The raw fused value at the peak, at every pixel but dilated ones.
  /// Variance of inverse depth, 1/m^2: 0 where there is no depth, infinite where the peak lies on
  /// the first or last plane or is flat.
  cv::Mat1f variance;
};

/// A depth between planes, in planes, and the variance of that, in planes^2.
struct PlanePosition {
  double position = 0;
  double variance = 0;
};

/// The part of an image that has depths: without a frame of two pixels; empty where nothing is
/// left.
cv::Rect insideFrame(cv::Size size);

/// The depth map of the kept pixels inside the frame.
/// @param positions one per kept pixel.
/// @param confidence of the whole view; shared, not copied.
DepthMap depthMapOf(const SparseMask& kept, const std::vector<PlanePosition>& positions,
                    const cv::Mat1f& confidence, const DepthPlanes& planes);

/// Grows the depths by a pixel: gives each empty pixel that lies beside kept ones the depth,
/// confidence and variance of the most confident of them (of equals the nearer depth), the frame
/// left alone. The paper's morphological filter (MF).
/// @param mask where pixels are kept.
void dilate(const SparseMask& kept, const cv::Mat1b& mask, DepthMap& map);

}  // namespace efm
