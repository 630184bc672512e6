// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/depth/sparse_mask.h"

namespace efm {

SparseMask::SparseMask(const cv::Mat1b& mask) {
  // Without a branch, which the processor would mispredict: each column is written, and the next
  // one overwrites it unless the mask has it.
  std::size_t count = 0;
  columns_.resize(static_cast<std::size_t>(cv::countNonZero(mask)) + 1);
  row_begin_.reserve(static_cast<std::size_t>(mask.rows) + 1);
  row_begin_.push_back(0);
  for (int y = 0; y < mask.rows; ++y) {
    const unsigned char* row = mask[y];
    for (int x = 0; x < mask.cols; ++x) {
      columns_[count] = x;
      count += row[x] != 0 ? 1 : 0;
    }
    row_begin_.push_back(count);
  }
  columns_.resize(count);
}

}  // namespace efm
