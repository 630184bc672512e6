// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/pictures/depth_picture.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <opencv2/imgproc.hpp>

namespace efm {

cv::Mat3b depthPicture(const cv::Mat1f& depth_m, const DepthPlanesOptions& limits) {
  const double far_inverse = 1 / limits.max_depth_m;
  const double range = 1 / limits.min_depth_m - far_inverse;
  cv::Mat1b nearness(depth_m.size(), 0);
  for (int y = 0; y < depth_m.rows; ++y) {
    for (int x = 0; x < depth_m.cols; ++x) {
      if (!(depth_m(y, x) > 0)) continue;
      const double fraction = (1.0 / static_cast<double>(depth_m(y, x)) - far_inverse) / range;
      nearness(y, x) = cv::saturate_cast<uchar>(255 * fraction);
    }
  }
  cv::Mat3b picture;
  cv::applyColorMap(nearness, picture, cv::COLORMAP_JET);
  picture.setTo(cv::Scalar::all(255), ~(depth_m > 0));
  return picture;
}

cv::Mat1b confidencePicture(const cv::Mat1f& confidence) {
  double maximum = 0;
  cv::minMaxLoc(confidence, nullptr, &maximum);
  cv::Mat1b picture;
  confidence.convertTo(picture, CV_8U, maximum > 0 ? -255 / maximum : 0, 255);
  return picture;
}

cv::Mat3b eventPicture(const cv::Mat_<cv::Vec2i>& counts) {
  constexpr int kFullColour = 3;  // events
  cv::Mat3b picture(counts.size(), cv::Vec3b(255, 255, 255));
  for (int y = 0; y < counts.rows; ++y) {
    for (int x = 0; x < counts.cols; ++x) {
      const int off = counts(y, x)[0];
      const int on = counts(y, x)[1];
      if (off + on == 0) continue;
      const int difference = std::clamp(on - off, -kFullColour, kFullColour);
      const auto other = static_cast<std::uint8_t>(180 - 60 * std::abs(difference));
      picture(y, x) = {other, other, other};
      if (difference > 0) picture(y, x)[2] = 255;
      if (difference < 0) picture(y, x)[0] = 255;
    }
  }
  return picture;
}

}  // namespace efm
