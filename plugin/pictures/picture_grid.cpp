// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/pictures/picture_grid.h"

#include <algorithm>

namespace efm {
namespace {

constexpr int kGap = 8;  // pixels

cv::Mat3b paper(int height, int width) {
  return cv::Mat3b(height, width, cv::Vec3b(255, 255, 255));
}

int gaps(std::size_t pictures) { return pictures > 1 ? kGap * static_cast<int>(pictures - 1) : 0; }

}  // namespace

cv::Mat3b sideBySide(const std::vector<cv::Mat3b>& pictures) {
  int width = gaps(pictures.size());
  int height = 0;
  for (const cv::Mat3b& picture : pictures) {
    width += picture.cols;
    height = std::max(height, picture.rows);
  }
  cv::Mat3b all = paper(height, width);
  int x = 0;
  for (const cv::Mat3b& picture : pictures) {
    picture.copyTo(all(cv::Rect({x, 0}, picture.size())));
    x += picture.cols + kGap;
  }
  return all;
}

cv::Mat3b oneBelowAnother(const std::vector<cv::Mat3b>& pictures) {
  int width = 0;
  int height = gaps(pictures.size());
  for (const cv::Mat3b& picture : pictures) {
    width = std::max(width, picture.cols);
    height += picture.rows;
  }
  cv::Mat3b all = paper(height, width);
  int y = 0;
  for (const cv::Mat3b& picture : pictures) {
    picture.copyTo(all(cv::Rect({(width - picture.cols) / 2, y}, picture.size())));
    y += picture.rows + kGap;
  }
  return all;
}

}  // namespace efm
