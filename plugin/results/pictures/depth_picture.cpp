// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/depth_picture.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <opencv2/imgproc.hpp>

#include "plugin/results/pictures/value_picture.h"

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
  // The rainbow goes from far to near.
  const bool far_first = palette == Palette::kBlueToRed;
  const double from = 1 / (far_first ? limits.max_depth_m : limits.min_depth_m);
  const double to = 1 / (far_first ? limits.min_depth_m : limits.max_depth_m);
  const double slope = 255 / (to - from);
  cv::Mat1f inverse;
  cv::divide(1.0, depth_m, inverse);
  cv::Mat1b levels;
  inverse.convertTo(levels, CV_8U, slope, -slope * from);
  cv::Mat3b picture = coloured(levels, palette);
  picture.setTo(cv::Scalar::all(255), ~(depth_m > 0));
  return picture;
}

cv::Mat1f reducedDepth(const cv::Mat1f& depth_m, int max_width) {
  const int factor = (depth_m.cols + max_width - 1) / max_width;
  if (factor <= 1) return depth_m;
  cv::Mat1f small(depth_m.rows / factor, depth_m.cols / factor, 0.0F);
  for (int y = 0; y < small.rows * factor; ++y) {
    for (int x = 0; x < small.cols * factor; ++x) {
      float& nearest = small(y / factor, x / factor);
      const float depth = depth_m(y, x);
      if (depth > 0 && (!(nearest > 0) || depth < nearest)) nearest = depth;
    }
  }
  return small;
}

AxisRange depthAxis(const DepthPlanesOptions& limits) {
  return {limits.min_depth_m, limits.max_depth_m, AxisScale::kInverse};
}

cv::Mat3b depthFigure(const DepthMap& map, const DepthPlanesOptions& limits) {
  ValuePicture figure;
  figure.values = map.depth;
  figure.range = depthAxis(limits);
  figure.unit = "m";
  figure.palette = Palette::kBrightToDark;
  figure.min_width = kMinFigureWidth;
  figure.under = lightGrey(map.confidence);
  return drawValues(figure);
}

cv::Mat1b confidenceFigure(const cv::Mat1f& confidence) {
  const double maximum = maximumOf(confidence);
  ValuePicture figure;
  figure.values = confidence;
  figure.range = {0, maximum > 0 ? maximum : 1};
  figure.unit = "confidence";
  figure.palette = Palette::kWhiteToBlack;
  figure.min_width = kMinFigureWidth;
  // Nothing in it has a colour, and one channel is encoded faster than three.
  cv::Mat1b grey;
  cv::extractChannel(drawValues(figure), grey, 0);
  return grey;
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
