// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/pictures/value_picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "plugin/pictures/plot_frame.h"

namespace efm {
namespace {

// In pixels.
constexpr int kTitleHeight = 24;
constexpr int kBarHeight = 12;
constexpr int kBarGap = 6;
constexpr int kTickHeight = 18;

int widthOf(const std::string& text) { return plotTextSize(text).width; }

/// Colours of fractions of the range. NaN is white.
cv::Mat3b coloured(const cv::Mat1f& fractions, bool red_first) {
  cv::Mat1b levels(fractions.size(), uchar{0});
  cv::Mat1b none(fractions.size(), uchar{0});
  for (int y = 0; y < fractions.rows; ++y) {
    for (int x = 0; x < fractions.cols; ++x) {
      const float fraction = fractions(y, x);
      if (std::isnan(fraction)) {
        none(y, x) = 255;
        continue;
      }
      const float along = red_first ? 1 - fraction : fraction;
      levels(y, x) = cv::saturate_cast<uchar>(255 * std::clamp(along, 0.F, 1.F));
    }
  }
  cv::Mat3b picture;
  cv::applyColorMap(levels, picture, cv::COLORMAP_JET);
  picture.setTo(cv::Scalar::all(255), none);
  return picture;
}

cv::Mat1f fractionsOf(const ValuePicture& picture) {
  cv::Mat1f fractions(picture.values.size());
  std::transform(picture.values.begin(), picture.values.end(), fractions.begin(), [&](float value) {
    return static_cast<float>(picture.range.fractionAlong(value));
  });
  return fractions;
}

cv::Mat3b barOf(const ValuePicture& picture, int width) {
  cv::Mat3b bar(kBarGap + kBarHeight + kTickHeight, width, cv::Vec3b(255, 255, 255));
  const cv::Rect area(1, kBarGap, width - 2, kBarHeight);
  cv::Mat1f fractions(kBarHeight, area.width);
  for (int x = 0; x < area.width; ++x) {
    fractions.col(x).setTo(static_cast<float>(x) / static_cast<float>(area.width - 1));
  }
  coloured(fractions, picture.red_first).copyTo(bar(area));
  cv::rectangle(bar, area, kPlotInk);
  const int baseline = bar.rows - 5;
  int next_free = 0;
  const int unit_from = width - widthOf(picture.unit) - 2;
  for (const AxisTick& tick : ticksOf(picture.range, std::max(3, width / 60))) {
    const int x = area.x + cvRound(picture.range.fractionAlong(tick.value) * (area.width - 1));
    const int from = x - widthOf(tick.text) / 2;
    const int to = from + widthOf(tick.text);
    cv::line(bar, {x, area.br().y}, {x, area.br().y + 2}, kPlotInk);
    if (from < next_free || to + 6 > unit_from) continue;
    writeText(bar, tick.text, {from, baseline});
    next_free = to + 6;
  }
  writeText(bar, picture.unit, {unit_from, baseline});
  return bar;
}

}  // namespace

cv::Mat3b drawValues(const ValuePicture& picture) {
  if (picture.values.empty()) {
    throw std::invalid_argument("the picture '" + picture.title + "' has no values");
  }
  cv::Mat3b image = coloured(fractionsOf(picture), picture.red_first);
  const int times = std::max(1, (picture.min_width + image.cols - 1) / image.cols);
  cv::resize(image, image, {}, times, times, cv::INTER_NEAREST);
  const cv::Mat3b bar = barOf(picture, image.cols);

  cv::Mat3b whole(kTitleHeight + image.rows + bar.rows, image.cols, cv::Vec3b(255, 255, 255));
  writeText(whole, picture.title, {2, kTitleHeight - 8});
  image.copyTo(whole(cv::Rect({0, kTitleHeight}, image.size())));
  cv::rectangle(whole, cv::Rect({0, kTitleHeight}, image.size()), cv::Scalar::all(200));
  bar.copyTo(whole(cv::Rect({0, kTitleHeight + image.rows}, bar.size())));
  return whole;
}

}  // namespace efm
