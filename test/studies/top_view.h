// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "maps/cloud_point.h"
#include "test/studies/wall_thickness.h"

namespace efm::studies {

/// What is drawn of a map seen from above, x to the right and y up.
struct TopViewOptions {
  double min_height_m = 0.15;  ///< Less of the floor, and of the ceiling, which would hide it all.
  double max_height_m = 2.6;
  double pixel_m = 0.012;
  double margin_m = 0.35;  ///< Around the walls.
};

/// A map's points, blue low and red high, the more of them the darker; the upright walls of the
/// room as grey lines where they truly are. World: z up.
cv::Mat3b drawTopView(const std::vector<CloudPoint>& points, const std::vector<Wall>& walls,
                      const TopViewOptions& options = {});

}  // namespace efm::studies
