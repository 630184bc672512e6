// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/depth_picture.h"

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <stdexcept>

namespace efm {
namespace {

// Sizes in pixels, for a picture of up to 480 pixels.
constexpr int kBarHeight = 12;
constexpr int kBarGap = 6;
constexpr int kTickHeight = 18;

/// Returns the scale of text and bar.
double scaleOf(int width) { return std::max(1.0, width / 480.0); }

/// Converts values to a scale on which the axis is linear. If the axis cannot show a value, its
/// result is meaningless.
cv::Mat1f linearised(const cv::Mat1f& values, AxisScale scale) {
  if (scale == AxisScale::kLinear) return values;
  cv::Mat1f linear;  // a new matrix: the values belong to the caller
  cv::divide(1.0, values, linear);
  return linear;
}

/// Returns levels of the palette. `none` becomes 255 for pixels without a value.
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

/// Returns the axis of depths between two limits: linear in inverse depth.
AxisRange depthAxis(const DepthPlanesOptions& limits) {
  return {limits.min_depth_m, limits.max_depth_m, AxisScale::kInverse};
}

/// Returns limits for colours: most depths lie in a part of the planes' limits, and the colours of
/// the other part would be lost. At least a factor of 1.1 apart, so that a wall is not all colours.
DepthPlanesOptions colourLimits(const std::vector<const cv::Mat1f*>& maps,
                                DepthPlanesOptions limits) {
  constexpr double kOutside = 0.02;  // fraction of the depths on each side
  constexpr double kMinRatio = 1.1;
  std::vector<float> depths_m;
  for (const cv::Mat1f* map : maps) {
    std::copy_if(map->begin(), map->end(), std::back_inserter(depths_m),
                 [](float depth_m) { return depth_m > 0; });
  }
  if (depths_m.empty()) return limits;
  const auto outside = static_cast<std::ptrdiff_t>(kOutside * static_cast<double>(depths_m.size()));
  const auto near = depths_m.begin() + outside;
  const auto far = depths_m.end() - 1 - outside;
  std::nth_element(depths_m.begin(), near, depths_m.end());
  const double near_m = *near;
  std::nth_element(depths_m.begin(), far, depths_m.end());
  const double far_m = *far;
  const double widening = std::sqrt(std::max(1.0, kMinRatio * near_m / far_m));
  limits.min_depth_m = near_m / widening;
  limits.max_depth_m = far_m * widening;
  return limits;
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
    throw std::invalid_argument("a picture of values has no values");
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

  cv::Mat3b whole(image.rows + bar.rows, image.cols, cv::Vec3b(255, 255, 255));
  image.copyTo(whole(cv::Rect({}, image.size())));
  cv::rectangle(whole, cv::Rect({}, image.size()), cv::Scalar::all(200));
  bar.copyTo(whole(cv::Rect({0, image.rows}, bar.size())));
  return whole;
}

namespace {

/// Pixels. Images of narrower sensors are enlarged.
constexpr int kMinFigureWidth = 640;

double maximumOf(const cv::Mat1f& confidence) {
  double maximum = 0;
  cv::minMaxLoc(confidence, nullptr, &maximum);
  return maximum;
}

/// Returns light grey for high confidence. The square root makes low confidences visible, too.
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

cv::Mat3b depthFigure(const DepthMap& map, const DepthPlanesOptions& planes) {
  return drawValues({map.depth, depthAxis(colourLimits({&map.depth}, planes)), "m",
                     Palette::kBrightToDark, kMinFigureWidth, lightGrey(map.confidence)});
}

cv::Mat1b confidenceFigure(const cv::Mat1f& confidence) {
  const double maximum = maximumOf(confidence);
  // The figure has no colours, and one channel is encoded faster than three channels.
  cv::Mat1b grey;
  cv::extractChannel(drawValues({confidence,
                                 {0, maximum > 0 ? maximum : 1},
                                 "confidence",
                                 Palette::kWhiteToBlack,
                                 kMinFigureWidth}),
                     grey, 0);
  return grey;
}

cv::Mat1b confidencePicture(const cv::Mat1f& confidence) {
  const double maximum = maximumOf(confidence);
  cv::Mat1b picture;
  confidence.convertTo(picture, CV_8U, maximum > 0 ? -255 / maximum : 0, 255);
  return picture;
}

cv::Mat3b eventPicture(const cv::Mat_<cv::Vec2i>& counts) {
  constexpr int kFullColour = 3;  // difference in events
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

namespace {

constexpr int kSheetWidth = 1500;   // pixels
constexpr int kCaptionHeight = 20;  // pixels
constexpr double kCaptionScale = 0.5;

cv::Mat3b withCaption(const cv::Mat3b& image, std::int64_t t_ref_ns) {
  cv::Mat3b whole(image.rows + kCaptionHeight, image.cols, cv::Vec3b(255, 255, 255));
  image.copyTo(whole(cv::Rect({}, image.size())));
  cv::rectangle(whole, cv::Rect({}, image.size()), cv::Scalar::all(200));
  writeText(whole, fmt::format("{:.2f} s", 1e-9 * static_cast<double>(t_ref_ns)),
            {1, whole.rows - 6}, kCaptionScale);
  return whole;
}

}  // namespace

void KeyframeSheet::add(std::int64_t t_ref_ns, const cv::Mat1f& depth_m) {
  const std::size_t keyframe = keyframes_++;
  if (keyframe % stride_ != 0) return;
  if (kept_.size() == kMaxKept) {
    for (std::size_t i = 0; 2 * i < kept_.size(); ++i) kept_[i] = kept_[2 * i];
    kept_.resize(kMaxKept / 2);
    stride_ *= 2;
    if (keyframe % stride_ != 0) return;
  }
  kept_.push_back({t_ref_ns, reducedDepth(depth_m, kMaxWidth).clone()});
}

cv::Mat3b KeyframeSheet::draw(const DepthPlanesOptions& planes) const {
  if (kept_.empty()) throw std::logic_error("a sheet needs a keyframe");
  std::vector<const cv::Mat1f*> maps;
  for (const Kept& kept : kept_) maps.push_back(&kept.depth_m);
  const DepthPlanesOptions limits = colourLimits(maps, planes);
  const std::size_t shown = std::min(kMaxShown, kept_.size());
  const auto columns =
      static_cast<std::size_t>(std::lround(std::sqrt(4.0 / 3.0 * static_cast<double>(shown))));
  const int times = std::max(1, kSheetWidth / (static_cast<int>(columns) * kept_[0].depth_m.cols));
  std::vector<cv::Mat3b> rows, row;
  for (std::size_t i = 0; i < shown; ++i) {
    const std::size_t last = std::max<std::size_t>(shown, 2) - 1;
    const Kept& kept = kept_[(i * (kept_.size() - 1) + last / 2) / last];
    cv::Mat3b image = depthPicture(kept.depth_m, limits, Palette::kBrightToDark);
    cv::resize(image, image, {}, times, times, cv::INTER_NEAREST);
    row.push_back(withCaption(image, kept.t_ref_ns));
    if (row.size() < columns && i + 1 < shown) continue;
    rows.push_back(sideBySide(row));
    row.clear();
  }
  // The last row begins at the left.
  cv::Mat3b& last = rows.back();
  cv::copyMakeBorder(last, last, 0, 0, 0, rows.front().cols - last.cols, cv::BORDER_CONSTANT,
                     cv::Scalar::all(255));
  constexpr int kBarWidth = 700;
  rows.push_back(drawBar(depthAxis(limits), Palette::kBrightToDark, "m",
                         std::min(kBarWidth, rows.front().cols)));
  return oneBelowAnother(rows);
}

}  // namespace efm
