// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/depth_picture.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace efm {

cv::Mat3b depthPicture(const cv::Mat1f& depth_m, const DepthPlanesOptions& limits) {
  const double far_inverse = 1 / limits.max_depth_m;
  const double range = 1 / limits.min_depth_m - far_inverse;
  cv::Mat1b nearness(depth_m.size(), 0);
  for (int y = 0; y < depth_m.rows; ++y) {
    for (int x = 0; x < depth_m.cols; ++x) {
      if (!(depth_m(y, x) > 0)) continue;
      const double share = (1.0 / static_cast<double>(depth_m(y, x)) - far_inverse) / range;
      nearness(y, x) = cv::saturate_cast<uchar>(255 * share);
    }
  }
  cv::Mat3b picture;
  cv::applyColorMap(nearness, picture, cv::COLORMAP_JET);
  picture.setTo(cv::Scalar::all(255), ~(depth_m > 0));
  return picture;
}

cv::Mat1b confidencePicture(const cv::Mat1f& confidence) {
  double largest = 0;
  cv::minMaxLoc(confidence, nullptr, &largest);
  cv::Mat1b picture;
  confidence.convertTo(picture, CV_8U, largest > 0 ? -255 / largest : 0, 255);
  return picture;
}

}  // namespace efm
