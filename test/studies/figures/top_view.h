// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "maps/cloud/cloud_point.h"
#include "test/studies/refinement/wall_thickness.h"

namespace efm::studies {

/// What is drawn of a map seen from above, x to the right and y up; world: z up.
struct TopView {
  Eigen::Vector2d low_m = Eigen::Vector2d::Zero();   ///< The corner at the lower left.
  Eigen::Vector2d high_m = Eigen::Vector2d::Ones();  ///< The corner at the upper right.
  double pixel_m = 0.01;
  /// Heights between which points are drawn: without the floor and the ceiling, which hide all.
  double min_height_m = 0.15;
  double max_height_m = 2.6;
};

/// All of a room and a little around it.
TopView viewOfAll(const std::vector<Wall>& walls, double pixel_m);

/// A map's points, blue low and red high, the more of them the darker; the room's upright walls as
/// grey lines where they truly are.
cv::Mat3b drawTopView(const std::vector<CloudPoint>& points, const std::vector<Wall>& walls,
                      const TopView& view);

}  // namespace efm::studies
