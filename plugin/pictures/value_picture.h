// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "plugin/pictures/plot_axis.h"

namespace efm {

/// An image of values as colours, with a bar that says which colour means what.
struct ValuePicture {
  std::string title;
  cv::Mat1f values;  ///< NaN: none, white.
  AxisRange range;   ///< What the colours span; beyond its ends, the colour of the end.
  std::string unit;  ///< At the bar.
  /// From red over green to blue instead of from blue: as depth is shown, red near.
  bool red_first = false;
  int min_width = 320;  ///< Smaller images are enlarged by a whole number to at least this, pixels.
};

/// @throws std::invalid_argument where there are no values.
cv::Mat3b drawValues(const ValuePicture& picture);

}  // namespace efm
