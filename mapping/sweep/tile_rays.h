// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <opencv2/core/types.hpp>

#include "mapping/dsi/plane_values.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/kernels/tile_scatter.h"

namespace efm {

/// The cells that the pixels of a tile get votes from. A cell lies between four pixels and has the
/// coordinates of its upper left one.
struct TileCells {
  /// Pixels on a side of a tile at most.
  static constexpr int kMaxPixels = kernels::kTileCells - 1;

  TileCells() = default;
  TileCells(const cv::Rect& tile, const ReferenceView& view);

  cv::Rect tile;     ///< Pixels.
  cv::Rect all;      ///< Also cells outside the view, which a pixel at its border has.
  cv::Rect in_view;  ///< Those of `all` that are inside the view.
  cv::Point origin;  ///< Of the coordinates of the tile's rays, pixels.
};

/// The rays that one tile sees of one input: those of a group of planes, and after them those of
/// one plane alone. Keeps its memory.
class TileRays {
 public:
  void clear() { size_ = 0; }
  /// The rays so far are those of the group.
  void keep() { kept_ = size_; }
  /// Removes the rays of one plane alone.
  void clearToKept() { size_ = kept_; }
  std::size_t size() const { return size_; }

  /// Makes room for more rays, which a kernel may write after the existing ones.
  void reserve(std::size_t more);
  /// Sets the number of rays after a kernel wrote some.
  void resize(std::size_t size) { size_ = size; }
  /// Fills up the last vector with rays that no tile sees.
  void pad();

  kernels::MovingRays view() { return {x_.data(), y_.data(), dx_.data(), dy_.data(), size_}; }

 private:
  PlaneValues x_, y_, dx_, dy_;
  std::size_t size_ = 0;
  std::size_t kept_ = 0;
};

}  // namespace efm
