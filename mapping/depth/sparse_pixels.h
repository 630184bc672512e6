// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <vector>

namespace efm {

/// The kept pixels of an image, in its order: a few percent of them in a semi-dense map, so that
/// what is done to them need not look at the others again.
class KeptPixels {
 public:
  /// Where the mask is not zero.
  explicit KeptPixels(const cv::Mat1b& mask);

  std::size_t size() const { return columns_.size(); }
  int rows() const { return static_cast<int>(row_begin_.size()) - 1; }
  /// The pixels of a row have indices [rowBegin(y), rowBegin(y + 1)), from left to right.
  std::size_t rowBegin(int y) const { return row_begin_[static_cast<std::size_t>(y)]; }
  int column(std::size_t pixel) const { return columns_[pixel]; }

  /// Calls `visit(index, place)` for each pixel.
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

}  // namespace efm
