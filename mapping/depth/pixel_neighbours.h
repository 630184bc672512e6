// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "mapping/depth/sparse_pixels.h"

namespace efm {

/// The kept pixels in the window of 9x9 pixels around a pixel, itself included.
class PixelNeighbours {
 public:
  static constexpr int kReach_px = 4;

  PixelNeighbours(const KeptPixels& kept, cv::Size size) : index_(size, -1) {
    kept.forEach([&](std::size_t i, cv::Point at) { index_(at) = static_cast<int>(i); });
  }

  /// Calls `visit(index, offset)` for each, row by row.
  template <typename Visit>
  void forEach(cv::Point pixel, Visit visit) const {
    const cv::Rect window =
        cv::Rect(pixel.x - kReach_px, pixel.y - kReach_px, 2 * kReach_px + 1, 2 * kReach_px + 1) &
        cv::Rect({0, 0}, index_.size());
    for (int y = window.y; y < window.y + window.height; ++y) {
      const int* row = index_[y];
      for (int x = window.x; x < window.x + window.width; ++x) {
        if (row[x] >= 0) visit(static_cast<std::size_t>(row[x]), cv::Point(x, y) - pixel);
      }
    }
  }

 private:
  cv::Mat1i index_;  // -1 where no pixel is kept
};

}  // namespace efm
