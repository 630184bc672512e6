// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

namespace efm {

/// A semi-dense depth map spread over the pixels around: the depth of the nearest pixel that has
/// one, and the distance to that pixel.
class NearestDepths {
 public:
  /// @param depth 0 where there is none.
  /// @param radius_px to which distance a depth is spread.
  NearestDepths(const cv::Mat1f& depth, double radius_px);

  /// No pixel has a depth.
  bool empty() const { return empty_; }
  /// Inverse depth (1/m) of the nearest pixel with a depth; 0 where none is within the radius.
  float inverseDepth(cv::Point pixel) const { return inverse_(pixel); }
  float distancePx(cv::Point pixel) const { return distance_(pixel); }

 private:
  bool empty_ = true;
  cv::Mat1f inverse_;
  cv::Mat1f distance_;
};

}  // namespace efm
