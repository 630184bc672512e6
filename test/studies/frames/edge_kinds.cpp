// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/frames/edge_kinds.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "mapping/base/option.h"
#include "mapping/geometry/rigid3.h"

namespace efm::studies {
namespace {

EdgeKind kindOf(double direction, const EdgeKindOptions& options) {
  const double from_horizontal_deg = std::min(direction, kPi - direction) * 180 / kPi;
  if (from_horizontal_deg <= options.vertical_deg) return EdgeKind::kVertical;
  if (90 - from_horizontal_deg <= options.horizontal_deg) return EdgeKind::kHorizontal;
  return EdgeKind::kOblique;
}

}  // namespace

ImageGradient imageGradient(const cv::Mat1f& grey, double blur_px) {
  cv::Mat1f smooth;
  cv::GaussianBlur(grey, smooth, {0, 0}, blur_px, blur_px, cv::BORDER_REPLICATE);
  ImageGradient gradient;
  // The weights of Sobel sum to 8 grey values per pixel.
  cv::Sobel(smooth, gradient.x, CV_32F, 1, 0, 3, 1.0 / 8, 0, cv::BORDER_REPLICATE);
  cv::Sobel(smooth, gradient.y, CV_32F, 0, 1, 3, 1.0 / 8, 0, cv::BORDER_REPLICATE);
  cv::magnitude(gradient.x, gradient.y, gradient.magnitude);
  return gradient;
}

void EdgeKindOptions::validate() const {
  requireOption(blur_px > 0, "blur_px", blur_px, "above 0");
  requireOption(min_gradient > 0, "min_gradient", min_gradient, "above 0");
  requireOption(line_gradient >= min_gradient, "line_gradient", line_gradient,
                "at least min_gradient");
  requireOption(horizontal_deg > 0 && vertical_deg > 0 && horizontal_deg + vertical_deg <= 90,
                "horizontal_deg + vertical_deg", horizontal_deg + vertical_deg,
                "both above 0, and at most 90 together");
}

EdgeKind EdgeKinds::kindNear(int x, int y) const {
  const cv::Rect around =
      cv::Rect(x - 1, y - 1, 3, 3) & cv::Rect(0, 0, magnitude_.cols, magnitude_.rows);
  cv::Point strongest;
  cv::minMaxLoc(magnitude_(around), nullptr, nullptr, nullptr, &strongest);
  return static_cast<EdgeKind>(kinds(around)(strongest));
}

EdgeKinds edgeKinds(const cv::Mat1f& grey, const EdgeKindOptions& options) {
  options.validate();
  const ImageGradient gradient = imageGradient(grey, options.blur_px);
  EdgeKinds edges;
  edges.kinds = cv::Mat1b(grey.size(), static_cast<std::uint8_t>(EdgeKind::kNone));
  edges.magnitude_ = gradient.magnitude;
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      if (static_cast<double>(edges.magnitude_(y, x)) < options.min_gradient) continue;
      double direction = std::atan2(static_cast<double>(gradient.y(y, x)), gradient.x(y, x));
      if (direction < 0) direction += kPi;
      if (direction >= kPi) direction -= kPi;
      edges.kinds(y, x) = static_cast<std::uint8_t>(kindOf(direction, options));
    }
  }

  // Canny takes gradients as 16-bit integers: hundredths of a grey value per pixel.
  constexpr double kPerGrey = 100;
  cv::Mat1s dx;
  cv::Mat1s dy;
  gradient.x.convertTo(dx, CV_16S, kPerGrey);
  gradient.y.convertTo(dy, CV_16S, kPerGrey);
  cv::Mat1b lines;
  cv::Canny(dx, dy, lines, kPerGrey * options.min_gradient, kPerGrey * options.line_gradient, true);
  edges.horizontal_lines = lines & (edges.kinds == static_cast<int>(EdgeKind::kHorizontal));
  edges.vertical_lines = lines & (edges.kinds == static_cast<int>(EdgeKind::kVertical));
  return edges;
}

}  // namespace efm::studies
