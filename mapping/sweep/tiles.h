// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <opencv2/core/types.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "mapping/dsi/dsi_columns.h"
#include "mapping/dsi/dsi_grid.h"
#include "mapping/dsi/plane_fusion.h"
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
  cv::Rect all;      ///< All cells, also outside the view: a pixel at its border has such cells.
  cv::Rect in_view;  ///< Those of `all` that are inside the view.
  cv::Point origin;  ///< Origin of the coordinates of the tile's rays, pixels.
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

/// Sums the votes of one input on one tile of a plane in cells (`kernels/tile_scatter.h`) and
/// resolves them into ray densities.
///
/// Use: `vote`; then `resolve`, or `addPair` with another input.
class TileAccumulator {
 public:
  /// @param kernel one of `availableKernels`, but not the plain one.
  explicit TileAccumulator(VotingKernel kernel);

  /// Moves to a tile. No votes are pending (asserted).
  void moveTo(const TileCells& tile);

  /// Votes with the tile's rays on one plane.
  /// @param rays padded. @param from_pixels from the plane of the rays' pixels to this one, 1/m.
  /// @param marks whether lines of cells with votes are marked, for `addPair`: it pays where few
  /// cells have votes. Both inputs must be alike.
  void vote(TileRays& rays, double from_pixels, bool marks = false);
  /// Resolves all pixels; no vote is left.
  /// @param density one value per pixel of the tile, row-major.
  /// @return the sum of all pixels' weights, in units. All tiles together have
  /// 2^kernels::kWeightBits units for each vote in the view.
  std::uint64_t resolve(float* density);

  /// Adds the mean of two inputs on the same tile to a sum; no vote is left. The bits are those of
  /// `resolve` and the rule's mean.
  /// @param rule AND-like. @param sum as `density`, and kernels::kSumPadding. @param units receives
  /// those of each input, added. @return the number of pixels that were not skipped.
  static int addPair(FusionRule rule, TileAccumulator& first, TileAccumulator& second, float* sum,
                     std::uint64_t units[2]);

 private:
  kernels::CellBuffer buffer() { return {cells_.data(), marked_ ? dirty_.data() : nullptr}; }
  std::uint64_t addFullCells(float* density) const;

  const kernels::TileFunctions& scatter_;
  const kernels::ResolveFunctions& resolve_;
  PixelValues<std::uint64_t> cells_;
  PixelValues<std::uint8_t> dirty_;
  std::vector<kernels::FullCell> full_;
  std::size_t full_cells_ = 0;
  PlaneValues density_;   // of a pair with full cells
  bool pending_ = false;  // votes that are not resolved
  bool marked_ = false;   // whether they are marked
  TileCells tile_;
};

/// Votes and fuses all inputs of one tile, plane by plane.
///
/// Two cameras under an AND-like rule, whose slots are summed, have a shortcut with the same bits:
/// their cells are resolved and fused at once.
class TileFusion {
 public:
  /// @param kernel one of `availableKernels`, but not the plain one.
  TileFusion(const FusionOptions& options, const FusionInputs& inputs, PlaneFusion::Keep keep,
             VotingKernel kernel);

  void moveTo(const TileCells& tile);
  /// The fused plane, until the next call.
  /// @param rays the tile's, padded: input (camera, slot) at camera * slots * groups + slot.
  /// @param from_pixels from the plane of the rays' pixels to this one, 1/m.
  const PlaneValues& fuse(std::vector<TileRays>& rays, double from_pixels);
  /// A camera's own plane after `fuse`, where cameras are kept.
  const PlaneValues& ofCamera(int camera) const { return planes_->ofCamera(camera); }
  /// The weights of each camera's votes on all tiles and planes so far, in units.
  const std::vector<std::uint64_t>& units() const { return units_; }

 private:
  const PlaneValues& fusePairs(std::vector<TileRays>& rays, double from_pixels);

  FusionOptions options_;
  FusionInputs inputs_;
  PlaneFusion::Keep keep_;
  bool pairs_;  // whether the shortcut applies
  // The second one serves the shortcut.
  std::array<TileAccumulator, 2> accumulators_;
  std::optional<PlaneFusion> planes_;
  PlaneValues sum_, group_sum_;  // of the shortcut
  std::vector<bool> skips_;      // by slot: whether marks made it skip many pixels of this tile
  std::vector<std::uint64_t> units_;
};

/// The peaks and columns of one DSI on all tiles: the fused one, or one camera's. With columns, of
/// the peaks the confidence alone.
class ViewPeaks {
 public:
  ViewPeaks(const DsiGrid& grid, int column_window, std::size_t tiles)
      : planes_(grid.planes.size()),
        column_window_(column_window),
        peaks_(unwrittenPeaks(grid.view, column_window > 0)),
        columns_(tiles) {}

  /// The whole view, when every tile is written. Its columns are moved out.
  SweptDsi sweptDsi() {
    if (column_window_ == 0) return {peaks_, {}};
    return {peaks_, DsiColumns(peaks_.confidence.size(), planes_, std::move(columns_))};
  }

 private:
  friend class TilePeaks;

  int planes_;
  int column_window_;
  DsiPeaks peaks_;
  std::vector<DsiColumns::Tile> columns_;  // by tile
};

/// The peaks and columns of one DSI on one tile at a time.
class TilePeaks {
 public:
  /// @param max_pixels of a tile.
  TilePeaks(int planes, int column_window, std::size_t max_pixels)
      : volume_(column_window > 0 ? planes : 0, column_window > 0 ? max_pixels : 0) {}

  void moveTo(const cv::Rect& tile, VotingKernel kernel) {
    tile_ = tile;
    peaks_.emplace(static_cast<std::size_t>(tile.area()), kernel);
  }
  /// Planes in increasing order, without a gap.
  void add(int plane, const PlaneValues& values) {
    peaks_->add(plane, values);
    if (!volume_.empty()) volume_.setPlane(plane, values);
  }
  /// Writes the tile to its position in the view. Several threads may write different tiles.
  void writeTo(ViewPeaks& view, std::size_t tile) const {
    peaks_->writeTo(view.peaks_, tile_);
    if (volume_.empty()) return;
    view.columns_[tile] = DsiColumns::select(tile_, view.peaks_.confidence(tile_), volume_,
                                             view.planes_, view.column_window_);
  }

 private:
  cv::Rect tile_;
  std::optional<RunningPeaks> peaks_;
  TileVolume volume_;
};

}  // namespace efm
