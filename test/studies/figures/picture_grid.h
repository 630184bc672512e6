// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "mapping/depth/depth_map.h"
#include "mapping/geometry/reference_view.h"

namespace efm::studies {

/// Pictures in rows of equal length, with labels. Text is ASCII.
struct PictureGrid {
  std::vector<std::string> columns;            ///< Labels above the columns; may be empty.
  std::vector<std::string> rows;               ///< Upright labels left of the rows; may be empty.
  std::vector<std::vector<cv::Mat>> pictures;  ///< [row][column]; grey, BGR, or empty for white.
  int width_px = 240;  ///< Of each picture. Smaller ones are enlarged without smoothing.
};

/// @throws std::invalid_argument where the rows have different lengths.
cv::Mat3b drawGrid(const PictureGrid& grid);

/// `depthPicture` with points 3 pixels wide: thin edges stay visible on a page.
cv::Mat3b boldDepthPicture(const cv::Mat1f& depth_m, const DepthPlanesOptions& limits);

/// A grid with a row of depth maps and a row of confidence maps, without columns.
PictureGrid depthAndConfidenceGrid(int width_px);
/// Adds a column to it.
void addColumn(const std::string& name, const DepthMap& map, const DepthPlanesOptions& limits,
               PictureGrid& grid);

}  // namespace efm::studies
