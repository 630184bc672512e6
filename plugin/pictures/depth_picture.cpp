// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/pictures/depth_picture.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "plugin/pictures/value_picture.h"

namespace efm {
namespace {

/// Pixels. Sensors that are narrower are enlarged.
constexpr int kMinFigureWidth = 640;

double maximumOf(const cv::Mat1f& confidence) {
  double maximum = 0;
  cv::minMaxLoc(confidence, nullptr, &maximum);
  return maximum;
}

/// Light grey where the confidence is high. The root shows low ones, too.
cv::Mat1b lightGrey(const cv::Mat1f& confidence) {
  constexpr double kDarkest = 60;  // levels below white
  const double maximum = maximumOf(confidence);
  cv::Mat1b grey(confidence.size(), uchar{255});
  if (!(maximum > 0)) return grey;
  cv::Mat1f root;
  cv::sqrt(confidence, root);
  root.convertTo(grey, CV_8U, -kDarkest / std::sqrt(maximum), 255);
  return grey;
}

}  // namespace

cv::Mat3b depthPicture(const cv::Mat1f& depth_m, const DepthPlanesOptions& limits,
                       Palette palette) {
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
  const bool from_far = palette == Palette::kBlueToRed;
  cv::Mat3b picture = coloured(from_far ? nearness : cv::Mat1b(~nearness), palette);
  picture.setTo(cv::Scalar::all(255), ~(depth_m > 0));
  return picture;
}

AxisRange depthAxis(const DepthPlanesOptions& limits) {
  return {limits.min_depth_m, limits.max_depth_m, AxisScale::kInverse};
}

cv::Mat3b depthFigure(const DepthMap& map, const DepthPlanesOptions& limits) {
  ValuePicture figure;
  figure.values = map.depth.clone();
  figure.values.setTo(std::numeric_limits<float>::quiet_NaN(), ~(map.depth > 0));
  figure.range = depthAxis(limits);
  figure.unit = "m";
  figure.palette = Palette::kBrightToDark;
  figure.min_width = kMinFigureWidth;
  figure.under = lightGrey(map.confidence);
  return drawValues(figure);
}

cv::Mat3b confidenceFigure(const cv::Mat1f& confidence) {
  const double maximum = maximumOf(confidence);
  ValuePicture figure;
  figure.values = confidence;
  figure.range = {0, maximum > 0 ? maximum : 1};
  figure.unit = "confidence";
  figure.palette = Palette::kWhiteToBlack;
  figure.min_width = kMinFigureWidth;
  return drawValues(figure);
}

cv::Mat1b confidencePicture(const cv::Mat1f& confidence) {
  const double maximum = maximumOf(confidence);
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
