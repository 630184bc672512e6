// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/motion/nearest_depths.h"

#include <opencv2/imgproc.hpp>
#include <vector>

namespace efm {

NearestDepths::NearestDepths(const cv::Mat1f& depth, double radius_px)
    : empty_(cv::countNonZero(depth) == 0),
      inverse_(cv::Mat1f::zeros(depth.size())),
      distance_(cv::Mat1f::zeros(depth.size())) {
  if (empty_) return;
  cv::Mat1i nearest;  // label of the nearest pixel that has a depth
  cv::distanceTransform(depth == 0, distance_, nearest, cv::DIST_L2, cv::DIST_MASK_5,
                        cv::DIST_LABEL_PIXEL);
  std::vector<float> inverse_of(depth.total() + 1);
  depth.forEach([&](float metres, const int* at) {
    if (metres > 0) inverse_of[static_cast<std::size_t>(nearest(at[0], at[1]))] = 1 / metres;
  });
  inverse_.forEach([&](float& inverse, const int* at) {
    if (distance_(at[0], at[1]) > radius_px) return;
    inverse = inverse_of[static_cast<std::size_t>(nearest(at[0], at[1]))];
  });
}

}  // namespace efm
