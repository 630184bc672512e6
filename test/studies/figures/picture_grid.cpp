// SPDX-License-Identifier: BSD-3-Clause
#include "test/studies/figures/picture_grid.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "plugin/results/pictures/depth_picture.h"

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

/// A strip with text in its middle.
cv::Mat3b label(const std::string& text, int length_px) {
  constexpr double kScale = 0.42;
  cv::Mat3b strip(kLabelPx, length_px, cv::Vec3b(255, 255, 255));
  int baseline = 0;
  const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, kScale, 1, &baseline);
  cv::putText(strip, text, {std::max(0, (length_px - size.width) / 2), kLabelPx - 6},
              cv::FONT_HERSHEY_SIMPLEX, kScale, {40, 40, 40}, 1, cv::LINE_AA);
  return strip;
}

/// The picture in the upper left corner of a white sheet.
cv::Mat3b padded(const cv::Mat3b& picture, cv::Size size) {
  cv::Mat3b sheet(size, cv::Vec3b(255, 255, 255));
  if (!picture.empty()) picture.copyTo(sheet(cv::Rect({0, 0}, picture.size())));
  return sheet;
}

}  // namespace

cv::Mat3b drawGrid(const PictureGrid& grid) {
  const std::size_t columns = grid.pictures.empty() ? 0 : grid.pictures.front().size();
  const int cell_width = grid.width_px + kGapPx;
  std::vector<cv::Mat> sheet;
  const auto addRow = [&](const std::vector<cv::Mat3b>& cells, const cv::Mat3b& name, int height) {
    std::vector<cv::Mat> row;
    if (!grid.rows.empty()) row.push_back(padded(name, {kLabelPx, height}));
    for (const cv::Mat3b& cell : cells) row.push_back(padded(cell, {cell_width, height}));
    cv::hconcat(row, sheet.emplace_back());
  };
  if (!grid.columns.empty()) {
    std::vector<cv::Mat3b> labels;
    for (const std::string& column : grid.columns) labels.push_back(label(column, grid.width_px));
    labels.resize(columns);
    addRow(labels, {}, kLabelPx);
  }
  for (std::size_t r = 0; r < grid.pictures.size(); ++r) {
    if (grid.pictures[r].size() != columns) {
      throw std::invalid_argument("a row of pictures is not complete");
    }
    std::vector<cv::Mat3b> cells;
    int height = 1;
    for (const cv::Mat& picture : grid.pictures[r]) {
      cells.push_back(picture.empty() ? cv::Mat3b() : fitted(picture, grid.width_px));
      height = std::max(height, cells.back().rows);
    }
    cv::Mat3b upright;
    if (r < grid.rows.size()) {
      cv::rotate(label(grid.rows[r], height), upright, cv::ROTATE_90_COUNTERCLOCKWISE);
    }
    addRow(cells, upright, height + kGapPx);
  }
  cv::Mat3b picture;
  cv::vconcat(sheet, picture);
  return picture;
}

cv::Mat3b boldDepthPicture(const cv::Mat1f& depth_m, const DepthPlanesOptions& limits) {
  cv::Mat1f bold;
  cv::dilate(depth_m, bold, cv::getStructuringElement(cv::MORPH_CROSS, {3, 3}));
  depth_m.copyTo(bold, depth_m > 0);
  return depthPicture(bold, limits);
}

PictureGrid depthAndConfidenceGrid(int width_px) {
  return {{}, {"depth", "confidence"}, {{}, {}}, width_px};
}

void addColumn(const std::string& name, const DepthMap& map, const DepthPlanesOptions& limits,
               PictureGrid& grid) {
  grid.columns.push_back(name);
  grid.pictures[0].push_back(boldDepthPicture(map.depth, limits));
  grid.pictures[1].push_back(confidencePicture(map.confidence));
}

}  // namespace efm::studies
