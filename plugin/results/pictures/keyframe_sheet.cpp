// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/keyframe_sheet.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "plugin/results/pictures/depth_picture.h"
#include "plugin/results/pictures/picture_grid.h"
#include "plugin/results/pictures/plot_frame.h"
#include "plugin/results/pictures/value_picture.h"

namespace efm {
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

cv::Mat3b KeyframeSheet::draw(const DepthPlanesOptions& limits) const {
  if (kept_.empty()) throw std::logic_error("a sheet needs a keyframe");
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
