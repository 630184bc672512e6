// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "mapping/geometry/depth_planes.h"

namespace efm::studies {

/// Pictures side by side, with labels: rows of equally many. Text is ASCII.
struct PictureGrid {
  std::vector<std::string> columns;            ///< Above each column; may be empty.
  std::vector<std::string> rows;               ///< Left of each row, upright; may be empty.
  std::vector<std::vector<cv::Mat>> pictures;  ///< [row][column]; grey or BGR; empty: left white.
  int width_px = 240;  ///< Of each picture; smaller ones are enlarged without smoothing.
};

/// A depth map for the eye as `depthPicture` makes it, each point 3 pixels wide: thin edges stay
/// visible on a page.
cv::Mat3b boldDepthPicture(const cv::Mat1f& depth_m, const DepthPlanesOptions& limits);

/// @throws std::invalid_argument where the rows are not equally long.
cv::Mat3b drawGrid(const PictureGrid& grid);

}  // namespace efm::studies
