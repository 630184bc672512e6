// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

namespace efm {

/// Colours of values, from the low end of their range to the high one.
enum class Palette {
  kBlueToRed,  ///< The rainbow "jet".
  /// For depth in print: plasma, whose lightness changes evenly, so that it can be read in grey and
  /// by colour-blind readers. Cut where it is too light for white paper.
  kBrightToDark,
  kWhiteToBlack,
  kRainbow,  ///< For height: turbo without its darkest ends, readable on white.
};

/// @param levels 0: the low end of the range, 255: the high end.
/// @return 8-bit BGR.
cv::Mat3b coloured(const cv::Mat1b& levels, Palette palette);

}  // namespace efm
