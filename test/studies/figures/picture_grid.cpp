// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/figures/picture_grid.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "plugin/pictures/depth_picture.h"

namespace efm::studies {
namespace {

constexpr int kGapPx = 4;
constexpr int kLabelPx = 20;

cv::Mat3b fitted(const cv::Mat& picture, int width_px) {
  cv::Mat3b colour;
  if (picture.channels() == 1) {
    cv::cvtColor(picture, colour, cv::COLOR_GRAY2BGR);
  } else {
    colour = picture;
  }
  const int height_px = (colour.rows * width_px + colour.cols / 2) / colour.cols;
  cv::Mat3b scaled;
  cv::resize(colour, scaled, {width_px, std::max(1, height_px)}, 0, 0,
             width_px < colour.cols ? cv::INTER_AREA : cv::INTER_NEAREST);
  cv::rectangle(scaled, {0, 0}, {scaled.cols - 1, scaled.rows - 1}, {190, 190, 190});
  return scaled;
}

/// Text in the middle of a strip.
cv::Mat3b label(const std::string& text, int length_px) {
  constexpr double kScale = 0.42;
  cv::Mat3b strip(kLabelPx, length_px, cv::Vec3b(255, 255, 255));
  int baseline = 0;
  const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, kScale, 1, &baseline);
  cv::putText(strip, text, {std::max(0, (length_px - size.width) / 2), kLabelPx - 6},
              cv::FONT_HERSHEY_SIMPLEX, kScale, {40, 40, 40}, 1, cv::LINE_AA);
  return strip;
}

}  // namespace

cv::Mat3b boldDepthPicture(const cv::Mat1f& depth_m, const DepthPlanesOptions& limits) {
  cv::Mat1f bold;
  cv::dilate(depth_m, bold, cv::getStructuringElement(cv::MORPH_CROSS, {3, 3}));
  depth_m.copyTo(bold, depth_m > 0);
  return depthPicture(bold, limits);
}

cv::Mat3b drawGrid(const PictureGrid& grid) {
  const std::size_t columns = grid.pictures.empty() ? 0 : grid.pictures.front().size();
  const int left = grid.rows.empty() ? 0 : kLabelPx;
  const int top = grid.columns.empty() ? 0 : kLabelPx;
  std::vector<std::vector<cv::Mat3b>> cells;
  std::vector<int> heights;
  for (const std::vector<cv::Mat>& row : grid.pictures) {
    if (row.size() != columns) throw std::invalid_argument("a row of pictures is not complete");
    cells.emplace_back();
    heights.push_back(1);
    for (const cv::Mat& picture : row) {
      cells.back().push_back(picture.empty() ? cv::Mat3b() : fitted(picture, grid.width_px));
      heights.back() = std::max(heights.back(), cells.back().back().rows);
    }
  }
  int height = top;
  for (const int of_row : heights) height += of_row + kGapPx;
  const int width = left + static_cast<int>(columns) * (grid.width_px + kGapPx);
  cv::Mat3b sheet(height, width, cv::Vec3b(255, 255, 255));
  const auto x_of = [&](std::size_t c) {
    return left + static_cast<int>(c) * (grid.width_px + kGapPx);
  };
  for (std::size_t c = 0; c < std::min(columns, grid.columns.size()); ++c) {
    label(grid.columns[c], grid.width_px)
        .copyTo(sheet(cv::Rect(x_of(c), 0, grid.width_px, kLabelPx)));
  }
  int y = top;
  for (std::size_t r = 0; r < cells.size(); ++r) {
    if (r < grid.rows.size()) {
      cv::Mat3b upright;
      cv::rotate(label(grid.rows[r], heights[r]), upright, cv::ROTATE_90_COUNTERCLOCKWISE);
      upright.copyTo(sheet(cv::Rect(0, y, kLabelPx, heights[r])));
    }
    for (std::size_t c = 0; c < columns; ++c) {
      const cv::Mat3b& cell = cells[r][c];
      if (!cell.empty()) cell.copyTo(sheet(cv::Rect(x_of(c), y, cell.cols, cell.rows)));
    }
    y += heights[r] + kGapPx;
  }
  return sheet;
}

}  // namespace efm::studies
