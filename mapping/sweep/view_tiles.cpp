// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/sweep/view_tiles.h"

#include <cstdint>

namespace efm {
namespace {

/// Where the parts of a side begin, and its end.
std::vector<int> cut(int side, int most) {
  const int parts = (side + most - 1) / most;
  std::vector<int> cuts;
  for (int i = 0; i <= parts; ++i) {
    cuts.push_back(static_cast<int>(std::int64_t{side} * i / parts));
  }
  return cuts;
}

}  // namespace

std::vector<cv::Rect> tilesOf(const ReferenceView& view, int most_pixels) {
  const std::vector<int> columns = cut(view.width, most_pixels);
  const std::vector<int> rows = cut(view.height, most_pixels);
  std::vector<cv::Rect> tiles;
  for (std::size_t r = 0; r + 1 < rows.size(); ++r) {
    for (std::size_t c = 0; c + 1 < columns.size(); ++c) {
      tiles.emplace_back(cv::Point(columns[c], rows[r]), cv::Point(columns[c + 1], rows[r + 1]));
    }
  }
  return tiles;
}

}  // namespace efm
