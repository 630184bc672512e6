// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/sparse_pixels.h"

namespace efm {

KeptPixels::KeptPixels(const cv::Mat1b& mask) {
  // Every column is written and only the kept ones are left standing: no branch to mispredict.
  std::size_t kept = 0;
  columns_.resize(static_cast<std::size_t>(cv::countNonZero(mask)) + 1);
  row_begin_.reserve(static_cast<std::size_t>(mask.rows) + 1);
  row_begin_.push_back(0);
  for (int y = 0; y < mask.rows; ++y) {
    const unsigned char* row = mask[y];
    for (int x = 0; x < mask.cols; ++x) {
      columns_[kept] = x;
      kept += row[x] != 0 ? 1 : 0;
    }
    row_begin_.push_back(kept);
  }
  columns_.resize(kept);
}

}  // namespace efm
