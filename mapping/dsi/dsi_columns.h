// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mapping/dsi/dsi_grid.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/kernels/kernels.h"

namespace efm {

namespace kernels {
struct PeakFunctions;
}  // namespace kernels

/// The peak of the DSI in the column of every pixel: images of the view's size. If whole columns
/// are stored (`DsiColumns`), only the confidence is filled: columns have the other values.
struct DsiPeaks {
  cv::Mat1f confidence;  ///< The largest fused value of the swept planes; 0 without votes.
  cv::Mat1i plane;       ///< The plane of `confidence`; the nearest if several are equal.
  cv::Mat1f before;      ///< The value one plane nearer; -1 at the nearest plane.
  cv::Mat1f after;       ///< The value one plane farther; -1 at the farthest plane.
};

/// Returns images of a view's size whose pixels have no values yet. @param confidence_alone if
/// true, the other images are empty.
DsiPeaks unwrittenPeaks(const ReferenceView& view, bool confidence_alone = false);

/// The peak of each pixel of a tile over the planes added so far: the argmax of the DSI (Ghosh and
/// Gallego 2022, Algorithm 1, line 5), and if required the values one plane before and after it.
class RunningPeaks {
 public:
  /// @param kernel one of `availableKernels`; all kernels give the same bits. @param neighbours
  /// true to keep the values beside the peak, which takes twice the time.
  explicit RunningPeaks(std::size_t pixels, VotingKernel kernel = fastestKernel(),
                        bool neighbours = true);

  /// Adds a plane. Planes are added in increasing order, without a gap; in any order without
  /// neighbours. @param values one per pixel.
  void add(int plane, const float* values);
  /// Return the largest value of each pixel, below 0 without a plane, and its plane.
  const PlaneValues& confidence() const { return best_; }
  const PixelValues<std::int32_t>& planes() const { return plane_; }
  /// Writes the tile, row by row, to its position in the images that are not empty. Several threads
  /// may write tiles that do not overlap.
  void writeTo(DsiPeaks& images, const cv::Rect& tile) const;

 private:
  const kernels::PeakFunctions* functions_;
  PlaneValues best_;
  PixelValues<std::int32_t> plane_;
  // Empty without neighbours.
  PlaneValues before_;
  PlaneValues after_;
  PlaneValues previous_;  // values of the plane added last
};

/// The fused values of all planes on one tile of the view: plane by plane, each row-major.
class TileVolume {
 public:
  TileVolume(int planes, std::size_t pixels)
      : stride_((pixels + 2 * kernels::kSumPadding - 1) / kernels::kSumPadding *
                kernels::kSumPadding),
        values_(static_cast<std::size_t>(planes) * stride_) {}

  void setPlane(int plane, const PlaneValues& values);
  /// Sets the first `pixels` values of all other planes: interpolated between the planes before and
  /// after. @param known one flag per plane; true for the first and the last plane.
  void interpolate(const std::vector<bool>& known, std::size_t pixels);
  /// Returns the values of a plane, with kernels::kSumPadding.
  float* plane(int plane) { return values_.data() + static_cast<std::size_t>(plane) * stride_; }
  const float* plane(int plane) const {
    return values_.data() + static_cast<std::size_t>(plane) * stride_;
  }

 private:
  std::size_t stride_;
  PlaneValues values_;
};

/// Returns the Gaussian mean around each pixel of a tile. Pixels outside the tile do not count.
/// @param window side of the Gaussian window, pixels, odd.
cv::Mat1f surroundingsOf(const cv::Mat1f& confidence, int window);

/// Columns of the fused DSI. A column has the values of one pixel on all planes. Only pixels that
/// may become points have a column: their confidence is above that of their surroundings. In
/// practice, such pixels are at most a third of a view. Only columns of the DSI are stored. A value
/// takes one byte (`kernels::columnValue`): with 100 to 400 planes, points and errors are the
/// same as with two bytes. With many more planes, neighbouring planes have the same byte:
/// `aggregateColumns` then compares planes that are further apart.
class DsiColumns {
 public:
  /// Columns of one tile.
  struct Tile {
    std::vector<cv::Point_<std::uint16_t>> pixels;  // coordinates in the view
    std::vector<float> units;                       // the value of each column's unit
    std::vector<std::uint8_t> roots;                // [pixel][plane], with kernels::kColumnPadding
  };
  /// Selects the columns of a tile whose confidence is above the Gaussian mean around it. If the
  /// window crosses the tile's edge, every pixel with votes has a column.
  /// @param confidence one value per pixel. @param window side of the Gaussian window, pixels, odd.
  static Tile select(const cv::Rect& tile, const cv::Mat1f& confidence, const TileVolume& volume,
                     int planes, int window);

  DsiColumns() = default;
  DsiColumns(cv::Size view, int planes, std::vector<Tile> tiles);
  DsiColumns(DsiColumns&&) = default;
  DsiColumns& operator=(DsiColumns&&) = default;

  int planes() const { return planes_; }
  std::size_t size() const { return columns_.size(); }
  bool has(cv::Point pixel) const { return index_(pixel) >= 0; }
  /// @param pixel a pixel that has a column.
  float value(cv::Point pixel, int plane) const {
    const Column& column = columns_[static_cast<std::size_t>(index_(pixel))];
    return column.unit * kernels::columnValue(column.roots[plane]);
  }
  /// Adds weight * value(pixel, plane) to sum[plane] for all planes.
  /// @param sum one value per plane, with kernels::kColumnPadding.
  void addTo(float* sum, cv::Point pixel, float weight) const;

 private:
  struct Column {
    const std::uint8_t* roots = nullptr;
    float unit = 0;
  };

  int planes_ = 0;
  std::vector<std::vector<std::uint8_t>> roots_;  // by tile
  std::vector<Column> columns_;
  cv::Mat1i index_;  // index in columns_; -1 if there is none
  const kernels::ColumnFunctions* functions_ = nullptr;
};

/// The result of a sweep for one DSI.
struct SweptDsi {
  DsiPeaks peaks;
  DsiColumns columns;  ///< Empty if not requested.
};

}  // namespace efm
