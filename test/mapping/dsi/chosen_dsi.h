// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "mapping/dsi/dsi_columns.h"
#include "mapping/geometry/reference_view.h"

namespace efm::test {

/// A DSI that a test writes down: [plane][row][column].
struct ChosenDsi {
  cv::Size size;
  int planes = 0;
  std::vector<float> values;

  ChosenDsi(const cv::Size& view, int plane_count)
      : size(view),
        planes(plane_count),
        values(static_cast<std::size_t>(view.area() * plane_count)) {}

  float& at(const cv::Point& pixel, int plane) {
    return values[static_cast<std::size_t>((plane * size.height + pixel.y) * size.width + pixel.x)];
  }
  float at(const cv::Point& pixel, int plane) const {
    return values[static_cast<std::size_t>((plane * size.height + pixel.y) * size.width + pixel.x)];
  }
  /// Writes the column of a pixel.
  void setColumn(const cv::Point& pixel, const std::function<double(int plane)>& value) {
    for (int plane = 0; plane < planes; ++plane) {
      at(pixel, plane) = static_cast<float>(value(plane));
    }
  }

  /// Its peaks, found one by one, and the columns of all pixels that have any value.
  SweptDsi swept() const {
    constexpr int kWindowBeyondAllTiles = 1001;
    DsiPeaks peaks{cv::Mat1f::zeros(size), cv::Mat1i::zeros(size), cv::Mat1f(size, -1.0F),
                   cv::Mat1f(size, -1.0F)};
    TileVolume volume(planes, static_cast<std::size_t>(size.area()));
    for (int plane = 0; plane < planes; ++plane) {
      PlaneValues of_plane;
      for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
          const cv::Point pixel(x, y);
          of_plane.push_back(at(pixel, plane));
          if (at(pixel, plane) > at(pixel, peaks.plane(pixel))) peaks.plane(pixel) = plane;
        }
      }
      volume.setPlane(plane, of_plane);
    }
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const cv::Point pixel(x, y);
        const int plane = peaks.plane(pixel);
        peaks.confidence(pixel) = at(pixel, plane);
        if (plane > 0) peaks.before(pixel) = at(pixel, plane - 1);
        if (plane < planes - 1) peaks.after(pixel) = at(pixel, plane + 1);
      }
    }
    std::vector<DsiColumns::Tile> all = {DsiColumns::select({{0, 0}, size}, peaks.confidence,
                                                            volume, planes, kWindowBeyondAllTiles)};
    return {std::move(peaks), DsiColumns(size, planes, std::move(all))};
  }

  /// The values as its columns have them: rounded.
  ChosenDsi rounded() const {
    const DsiColumns columns = swept().columns;
    ChosenDsi copy(size, planes);
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        if (!columns.has({x, y})) continue;
        copy.setColumn({x, y}, [&](int plane) { return columns.value({x, y}, plane); });
      }
    }
    return copy;
  }
};

}  // namespace efm::test
