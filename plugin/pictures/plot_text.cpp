// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/pictures/plot_text.h"

#include <opencv2/imgproc.hpp>

namespace efm {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;

}  // namespace

cv::Scalar plotInk() { return cv::Scalar::all(40); }

cv::Size plotTextSize(const std::string& text, double scale) {
  int baseline = 0;
  const cv::Size size = cv::getTextSize(text, kFont, scale, 1, &baseline);
  return {size.width, size.height + baseline};
}

void writeText(cv::Mat3b& picture, const std::string& text, cv::Point at, double scale) {
  cv::putText(picture, text, at, kFont, scale, plotInk(), 1, cv::LINE_AA);
}

void writeTextUpwards(cv::Mat3b& picture, const std::string& text, cv::Point centre) {
  const cv::Size size = plotTextSize(text) + cv::Size(2, 2);
  cv::Mat3b sideways(size, cv::Vec3b(255, 255, 255));
  writeText(sideways, text, {0, size.height - 6});
  cv::Mat3b upright;
  cv::rotate(sideways, upright, cv::ROTATE_90_COUNTERCLOCKWISE);
  const cv::Rect place(centre - cv::Point(upright.cols / 2, upright.rows / 2), upright.size());
  const cv::Rect seen = place & cv::Rect({}, picture.size());
  upright(seen - place.tl()).copyTo(picture(seen));
}

}  // namespace efm
