// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/picture_grid.h"

#include <algorithm>

namespace efm {
namespace {

const cv::Scalar kWhite = cv::Scalar::all(255);
constexpr int kGap = 8;  // pixels between two pictures

cv::Size largestSize(const std::vector<cv::Mat3b>& pictures) {
  cv::Size size;
  for (const cv::Mat3b& picture : pictures) {
    size = {std::max(size.width, picture.cols), std::max(size.height, picture.rows)};
  }
  return size;
}

}  // namespace

cv::Mat3b sideBySide(const std::vector<cv::Mat3b>& pictures) {
  const int height = largestSize(pictures).height;
  std::vector<cv::Mat3b> padded(pictures.size());
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    cv::copyMakeBorder(pictures[i], padded[i], 0, height - pictures[i].rows, i > 0 ? kGap : 0, 0,
                       cv::BORDER_CONSTANT, kWhite);
  }
  cv::Mat3b joined;
  cv::hconcat(padded, joined);
  return joined;
}

cv::Mat3b oneBelowAnother(const std::vector<cv::Mat3b>& pictures) {
  const int width = largestSize(pictures).width;
  std::vector<cv::Mat3b> padded(pictures.size());
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const int left = (width - pictures[i].cols) / 2;
    cv::copyMakeBorder(pictures[i], padded[i], i > 0 ? kGap : 0, 0, left,
                       width - pictures[i].cols - left, cv::BORDER_CONSTANT, kWhite);
  }
  cv::Mat3b joined;
  cv::vconcat(padded, joined);
  return joined;
}

}  // namespace efm
