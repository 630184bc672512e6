// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "maps/cloud/map_point.h"
#include "test/studies/refinement/wall_thickness.h"

namespace efm::studies {

/// The part of a map in a view from above: x to the right, y up. World: z up.
struct TopView {
  Eigen::Vector2d low_m = Eigen::Vector2d::Zero();   ///< Lower left corner.
  Eigen::Vector2d high_m = Eigen::Vector2d::Ones();  ///< Upper right corner.
  double pixel_m = 0.01;
  /// Range of heights. Floor and ceiling are excluded, because they hide everything else.
  double min_height_m = 0.15;
  double max_height_m = 2.6;
};

/// A view of a whole room with a margin.
TopView viewOfAll(const std::vector<Wall>& walls, double pixel_m);

/// Draws a map's points, blue low and red high, darker where there are more, and the true upright
/// walls as grey lines.
cv::Mat3b drawTopView(const MapCloud& cloud, const std::vector<Wall>& walls, const TopView& view);

}  // namespace efm::studies
