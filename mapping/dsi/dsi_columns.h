// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "mapping/dsi/dsi_peaks.h"
#include "mapping/dsi/plane_values.h"
#include "mapping/kernels/columns.h"

namespace efm {

/// The fused values of all planes on one tile of the view: plane by plane, each row-major.
class TileVolume {
 public:
  TileVolume(int planes, std::size_t pixels)
      : pixels_(pixels), values_(static_cast<std::size_t>(planes) * pixels) {}

  bool empty() const { return values_.empty(); }
  void setPlane(int plane, const PlaneValues& values);
  const float* plane(int plane) const {
    return values_.data() + static_cast<std::size_t>(plane) * pixels_;
  }

 private:
  std::size_t pixels_;
  PlaneValues values_;
};

/// Columns of the fused DSI: the values of a pixel on all planes. Only pixels that may become
/// points have one: their confidence is above that of their surroundings. They are a third of a
/// view at most in practice, and the only part of the DSI that is stored. A value takes a byte
/// (`kernels::columnValue`), which moves no depth that matters: with 100 to 400 planes, points and
/// errors are as with two bytes. With many more, neighbouring planes share a byte:
/// `aggregateColumns` then compares planes that are further apart.
class DsiColumns {
 public:
  /// Columns of one tile.
  struct Tile {
    std::vector<cv::Point_<std::uint16_t>> pixels;  // of the view
    std::vector<float> units;                       // per pixel
    std::vector<std::uint8_t> roots;                // [pixel][plane], with kernels::kColumnPadding
  };
  /// Selects the columns of a tile whose confidence is above the Gaussian mean around it. Where the
  /// window crosses the tile's edge, every pixel with votes has a column.
  /// @param confidence of the tile's pixels. @param window side of the Gaussian window, odd.
  static Tile select(const cv::Rect& tile, const cv::Mat1f& confidence, const TileVolume& volume,
                     int planes, int window);

  DsiColumns() = default;
  DsiColumns(cv::Size view, int planes, std::vector<Tile> tiles);
  DsiColumns(DsiColumns&&) = default;
  DsiColumns& operator=(DsiColumns&&) = default;

  int planes() const { return planes_; }
  std::size_t size() const { return columns_.size(); }
  bool has(cv::Point pixel) const { return index_(pixel) >= 0; }
  /// @param pixel has a column.
  float value(cv::Point pixel, int plane) const {
    const Column& column = columns_[static_cast<std::size_t>(index_(pixel))];
    return column.unit * kernels::columnValue(column.roots[plane]);
  }
  /// sum[plane] += weight * value(pixel, plane) for all planes.
  /// @param sum with kernels::kColumnPadding.
  void addTo(float* sum, cv::Point pixel, float weight) const;

 private:
  struct Column {
    const std::uint8_t* roots = nullptr;
    float unit = 0;
  };

  int planes_ = 0;
  std::vector<std::vector<std::uint8_t>> roots_;  // of the tiles
  std::vector<Column> columns_;
  cv::Mat1i index_;  // of columns_; -1 where there is none
  const kernels::ColumnFunctions* functions_ = nullptr;
};

/// The result of a sweep for one DSI.
struct SweptDsi {
  DsiPeaks peaks;
  DsiColumns columns;  ///< Where asked for.
};

}  // namespace efm
