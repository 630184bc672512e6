// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/depth/sparse_mask.h"
#include "mapping/geometry/depth_planes.h"

namespace efm {

/// What became of the pixels with local contrast, which could have a depth.
struct PixelCounts {
  std::uint64_t candidates = 0;
  std::uint64_t at_nearest = 0;   ///< The peak lies on the first plane: no depth.
  std::uint64_t at_farthest = 0;  ///< The peak lies on the last plane: no depth.
  std::uint64_t ambiguous = 0;    ///< Below `min_quality`: no depth.

  PixelCounts& operator+=(const PixelCounts& other);
};

/// A semi-dense depth map in the reference view.
struct DepthMap {
  cv::Mat1f depth;       ///< z-depth in metres; 0 where there is none.
  cv::Mat1f confidence;  ///< The raw fused value at the peak, at every pixel except dilated ones.
  /// Variance of inverse depth, 1/m^2: 0 where there is no depth, infinite where the peak is flat
  /// or lies on the first or last plane.
  cv::Mat1f variance;
  PixelCounts pixels;  ///< `ExtractionMethod::kPaper` keeps every candidate.
};

/// A position between planes, in planes, and its variance, in planes^2.
struct PlanePosition {
  double position = 0;
  double variance = 0;
};

/// The image without a frame of two pixels, which has no depths; may be empty.
cv::Rect insideFrame(cv::Size size);

/// The depth map of a mask's pixels inside the frame.
/// @param positions one per pixel of the mask.
/// @param confidence of the whole view; shared, not copied.
DepthMap depthMapOf(const SparseMask& mask, const std::vector<PlanePosition>& positions,
                    const cv::Mat1f& confidence, const DepthPlanes& planes);

/// Grows the depths by a pixel, except into the frame: an empty pixel adjacent to pixels of the
/// mask gets depth, confidence and variance of the most confident one (of equals, the nearer one).
/// The paper's morphological filter (MF).
/// @param sparse the pixels of `mask`.
void dilate(const SparseMask& sparse, const cv::Mat1b& mask, DepthMap& map);

}  // namespace efm
