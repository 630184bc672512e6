// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/results/pictures/palette.h"

#include <opencv2/imgproc.hpp>

namespace efm {
namespace {

/// A part of one of OpenCV's colour maps; `from` > `to` reverses it.
struct PaletteSource {
  cv::ColormapTypes map;
  double from;
  double to;
};

PaletteSource sourceOf(Palette palette) {
  if (palette == Palette::kBlueToRed) return {cv::COLORMAP_JET, 0, 1};
  if (palette == Palette::kRainbow) return {cv::COLORMAP_TURBO, 0.06, 0.96};
  return {cv::COLORMAP_PLASMA, 0.88, 0};  // kBrightToDark
}

/// The colours of the levels 0 to 255.
cv::Mat3b tableOf(Palette palette) {
  cv::Mat1b positions(1, 256);
  const PaletteSource source = sourceOf(palette);
  for (int level = 0; level < 256; ++level) {
    positions(0, level) =
        cv::saturate_cast<uchar>(255 * source.from + (source.to - source.from) * level);
  }
  cv::Mat3b table;
  cv::applyColorMap(positions, table, source.map);
  return table;
}

}  // namespace

cv::Mat3b coloured(const cv::Mat1b& levels, Palette palette) {
  cv::Mat3b picture;
  if (palette == Palette::kWhiteToBlack) {
    cv::cvtColor(~levels, picture, cv::COLOR_GRAY2BGR);
  } else {
    cv::applyColorMap(levels, picture, tableOf(palette).reshape(3, 256));
  }
  return picture;
}

}  // namespace efm
