// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "plugin/results/pictures/palette.h"
#include "plugin/results/pictures/plot_axis.h"

namespace efm {

/// An image of values as colours, with a colour bar.
struct ValuePicture {
  std::string title;  ///< Empty: the picture begins with the image.
  cv::Mat1f values;   ///< NaN: no value.
  AxisRange range;    ///< Of the colours. A value outside has the colour of the nearer end.
  std::string unit;   ///< Written at the bar.
  Palette palette = Palette::kBlueToRed;
  int min_width = 320;   ///< Pixels. A smaller image is enlarged by a whole number.
  cv::Mat1b under = {};  ///< Grey levels where there is no value. Empty: white.
};

/// Text and bar are larger in wide pictures, so that they can be read where the picture is as wide
/// as a column of a paper.
/// @throws std::invalid_argument if there are no values.
cv::Mat3b drawValues(const ValuePicture& picture);

/// The colour bar alone, `width` pixels wide: colours, ticks and the unit on white.
cv::Mat3b drawBar(const AxisRange& range, Palette palette, const std::string& unit, int width);

}  // namespace efm
