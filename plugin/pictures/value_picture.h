// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "plugin/pictures/plot_axis.h"

namespace efm {

/// An image of values as colours, with a colour bar.
struct ValuePicture {
  std::string title;
  cv::Mat1f values;        ///< NaN (no value) is white.
  AxisRange range;         ///< Of the colours. A value outside has the colour of the nearer end.
  std::string unit;        ///< Written at the bar.
  bool red_first = false;  ///< Red is the low end, as for depth. Otherwise blue is.
  int min_width = 320;     ///< Pixels. A smaller image is enlarged by a whole number.
};

/// @throws std::invalid_argument if there are no values.
cv::Mat3b drawValues(const ValuePicture& picture);

}  // namespace efm
