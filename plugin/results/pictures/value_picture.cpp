// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/value_picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "plugin/results/pictures/plot_frame.h"

namespace efm {
namespace {

// In pixels of a picture of up to 480 pixels.
constexpr int kTitleHeight = 24;
constexpr int kBarHeight = 12;
constexpr int kBarGap = 6;
constexpr int kTickHeight = 18;

/// The size of text and bar.
double scaleOf(int width) { return std::max(1.0, width / 480.0); }

/// The values on a scale on which the axis is linear. Where the axis cannot show a value it is
/// meaningless.
cv::Mat1f linearised(const cv::Mat1f& values, AxisScale scale) {
  if (scale == AxisScale::kLinear) return values;
  cv::Mat1f linear;  // not a header of the values, which are the caller's
  if (scale == AxisScale::kInverse) cv::divide(1.0, values, linear);
  if (scale == AxisScale::kLogarithmic) cv::log(values, linear);
  return linear;
}

/// Levels of the palette. `none` is 255 where there is no value.
cv::Mat1b levelsOf(const ValuePicture& picture, cv::Mat1b& none) {
  const AxisRange& range = picture.range;
  const cv::Mat1f ends =
      linearised((cv::Mat1f(1, 2) << static_cast<float>(range.from), static_cast<float>(range.to)),
                 range.scale);
  const double slope = 255 / (static_cast<double>(ends(1)) - ends(0));
  cv::Mat1b levels;
  linearised(picture.values, range.scale).convertTo(levels, CV_8U, slope, -slope * ends(0));
  none = range.scale == AxisScale::kLinear ? cv::Mat1b(picture.values != picture.values)
                                           : cv::Mat1b(~(picture.values > 0));
  return levels;
}

}  // namespace

cv::Mat3b drawBar(const AxisRange& range, Palette palette, const std::string& unit, int width) {
  const double scale = scaleOf(width);
  const auto scaled = [&](int pixels) { return cvRound(scale * pixels); };
  const double text_scale = scale * kPlotTextScale;
  const auto widthOf = [&](const std::string& text) {
    return plotTextSize(text, text_scale).width;
  };

  cv::Mat3b bar(scaled(kBarGap + kBarHeight + kTickHeight), width, cv::Vec3b(255, 255, 255));
  const cv::Rect area(1, scaled(kBarGap), width - 2, scaled(kBarHeight));
  cv::Mat1b levels(area.size());
  for (int x = 0; x < area.width; ++x) {
    levels.col(x).setTo(cv::saturate_cast<uchar>(255.0 * x / (area.width - 1)));
  }
  coloured(levels, palette).copyTo(bar(area));
  cv::rectangle(bar, area, kPlotInk);
  const int baseline = bar.rows - scaled(5);
  int next_free = 0;
  const int unit_from = width - widthOf(unit) - 2;
  const int max_ticks = std::max(3, cvRound(width / (60 * scale)));
  for (const AxisTick& tick : ticksOf(range, max_ticks)) {
    const int x = area.x + cvRound(range.fractionAlong(tick.value) * (area.width - 1));
    const int from = x - widthOf(tick.text) / 2;
    const int to = from + widthOf(tick.text);
    cv::line(bar, {x, area.br().y}, {x, area.br().y + scaled(2)}, kPlotInk, scaled(1));
    if (from < next_free || to + scaled(6) > unit_from) continue;
    writeText(bar, tick.text, {from, baseline}, text_scale);
    next_free = to + scaled(6);
  }
  writeText(bar, unit, {unit_from, baseline}, text_scale);
  return bar;
}

cv::Mat3b drawValues(const ValuePicture& picture) {
  if (picture.values.empty()) {
    throw std::invalid_argument("the picture '" + picture.title + "' has no values");
  }
  cv::Mat1b none;
  cv::Mat3b image = coloured(levelsOf(picture, none), picture.palette);
  if (picture.under.empty()) {
    image.setTo(cv::Scalar::all(255), none);
  } else {
    coloured(~picture.under, Palette::kWhiteToBlack).copyTo(image, none);
  }
  const int times = std::max(1, (picture.min_width + image.cols - 1) / image.cols);
  if (times > 1) cv::resize(image, image, {}, times, times, cv::INTER_NEAREST);
  const cv::Mat3b bar = drawBar(picture.range, picture.palette, picture.unit, image.cols);

  const double scale = scaleOf(image.cols);
  const int top = picture.title.empty() ? 0 : cvRound(scale * kTitleHeight);
  cv::Mat3b whole(top + image.rows + bar.rows, image.cols, cv::Vec3b(255, 255, 255));
  writeText(whole, picture.title, {2, top - cvRound(scale * 8)}, scale * kPlotTextScale);
  image.copyTo(whole(cv::Rect({0, top}, image.size())));
  cv::rectangle(whole, cv::Rect({0, top}, image.size()), cv::Scalar::all(200));
  bar.copyTo(whole(cv::Rect({0, top + image.rows}, bar.size())));
  return whole;
}

}  // namespace efm
