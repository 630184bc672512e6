// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

namespace efm {

/// The non-zero pixels of a mask, row by row, from left to right. A semi-dense depth map uses a few
/// percent of the pixels; work on a sparse mask skips the others.
class SparseMask {
 public:
  explicit SparseMask(const cv::Mat1b& mask);

  std::size_t size() const { return columns_.size(); }
  int rows() const { return static_cast<int>(row_begin_.size()) - 1; }
  /// The pixels of row `y` have indices [rowBegin(y), rowBegin(y + 1)).
  std::size_t rowBegin(int y) const { return row_begin_[static_cast<std::size_t>(y)]; }
  int column(std::size_t pixel) const { return columns_[pixel]; }

  /// Calls `visit(index, position)` for each pixel.
  template <typename Visit>
  void forEach(Visit visit) const {
    for (int y = 0; y < rows(); ++y) {
      for (std::size_t i = rowBegin(y); i < rowBegin(y + 1); ++i)
        visit(i, cv::Point(columns_[i], y));
    }
  }

 private:
  std::vector<int> columns_;
  std::vector<std::size_t> row_begin_;  // one more than rows
};

/// Finds the pixels of a sparse mask in the window of 9x9 pixels around a pixel, itself included.
class PixelNeighbours {
 public:
  static constexpr int kRadius_px = 4;
  static constexpr std::size_t kMaxPixels = (2 * kRadius_px + 1) * (2 * kRadius_px + 1);

  /// Gaussian weights by the square of the distance.
  using Weights = std::array<float, 2 * kRadius_px * kRadius_px + 1>;
  static Weights gaussian(float sigma_px) {
    Weights weights{};
    for (std::size_t distance_sq = 0; distance_sq < weights.size(); ++distance_sq) {
      weights[distance_sq] = std::exp(-static_cast<float>(distance_sq) / (2 * sigma_px * sigma_px));
    }
    return weights;
  }

  PixelNeighbours(const SparseMask& mask, cv::Size size) : index_(size, -1) {
    mask.forEach([&](std::size_t i, cv::Point at) { index_(at) = static_cast<int>(i); });
  }

  /// Calls `visit(index, offset)` for each, row by row.
  template <typename Visit>
  void forEach(cv::Point pixel, Visit visit) const {
    const cv::Rect window = cv::Rect(pixel.x - kRadius_px, pixel.y - kRadius_px, 2 * kRadius_px + 1,
                                     2 * kRadius_px + 1) &
                            cv::Rect({0, 0}, index_.size());
    for (int y = window.y; y < window.y + window.height; ++y) {
      const int* row = index_[y];
      for (int x = window.x; x < window.x + window.width; ++x) {
        if (row[x] >= 0) visit(static_cast<std::size_t>(row[x]), cv::Point(x, y) - pixel);
      }
    }
  }

 private:
  cv::Mat1i index_;  // -1: not in the mask
};

}  // namespace efm
