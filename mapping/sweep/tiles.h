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
/// coordinates of its upper left pixel.
struct TileCells {
  /// Maximum number of pixels per side of a tile.
  static constexpr int kMaxPixels = kernels::kTileCells - 1;

  TileCells() = default;
  TileCells(const cv::Rect& tile, const ReferenceView& view);

  cv::Rect tile;     ///< Pixels.
  cv::Rect all;      ///< All cells; a tile at the view's border has cells outside the view.
  cv::Rect in_view;  ///< The cells of `all` that are inside the view.
  cv::Point origin;  ///< Origin of the coordinates of the tile's rays, pixels.
};

/// The rays of one input that one tile sees: first the rays of a group of planes, then the rays of
/// one plane alone. Memory is reused.
class TileRays {
 public:
  void clear() { size_ = 0; }
  /// Marks the rays so far as the rays of the group.
  void keep() { kept_ = size_; }
  /// Removes the rays of one plane alone.
  void clearToKept() { size_ = kept_; }
  std::size_t size() const { return size_; }

  /// Allocates memory for more rays, which a kernel may write after the existing rays.
  void reserve(std::size_t more);
  /// Sets the number of rays after a kernel wrote rays.
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

  /// Moves to a tile. No votes may be pending (asserted).
  void moveTo(const TileCells& tile);

  /// Votes with the tile's rays on one plane.
  /// @param rays padded. @param from_pixels from the plane of the rays' pixels to this plane, 1/m.
  /// @param marks true to mark lines of cells with votes, for `addPair`: it is faster if few cells
  /// have votes. Both inputs of `addPair` need the same value.
  void vote(TileRays& rays, double from_pixels, bool marks = false);
  /// Resolves all pixels. No votes are pending afterwards.
  /// @param density one value per pixel of the tile, row-major.
  /// @return the sum of all pixels' weights, in units. All tiles together have
  /// 2^kernels::kWeightBits units for each vote in the view.
  std::uint64_t resolve(float* density);

  /// Fuses two inputs of one tile by a rule and adds the result to `sum`. Bit-identical to
  /// `resolve` of each followed by the rule. No votes are pending afterwards. @return the number of
  /// pixels not skipped.
  /// @param rule an AND-like rule. @param sum as `density`, with kernels::kSumPadding.
  /// @param units the sum of weights of each input, in units, is added to it.
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
  PlaneValues density_;   // for a pair with full cells
  bool pending_ = false;  // true if votes are not resolved
  bool marked_ = false;   // true if their lines are marked
  TileCells tile_;
};

/// Votes and fuses all inputs of one tile, plane by plane.
///
/// There is a shortcut for two cameras with an AND-like rule and summed slots: their cells are
/// resolved and fused in one step, with the same bits.
class TileFusion {
 public:
  /// @param kernel one of `availableKernels`, but not the plain one.
  TileFusion(const FusionOptions& options, const FusionInputs& inputs, PlaneFusion::Keep keep,
             VotingKernel kernel);

  void moveTo(const TileCells& tile);
  /// Fuses a plane.
  /// @param rays padded: input (camera, slot) is at camera * slots_per_group * groups + slot.
  /// @param from_pixels from the plane of the rays' pixels to this plane, 1/m.
  /// @param fused one value per pixel, with kernels::kSumPadding.
  void fuse(std::vector<TileRays>& rays, double from_pixels, float* fused);
  /// Returns a camera's own plane after `fuse`. Needs `PlaneFusion::Keep::kCameras`.
  const PlaneValues& ofCamera(int camera) const { return planes_->ofCamera(camera); }
  /// Returns the weights of each camera's votes on all tiles and planes so far, in units.
  const std::vector<std::uint64_t>& units() const { return units_; }

 private:
  void fusePairs(std::vector<TileRays>& rays, double from_pixels, float* fused);

  FusionOptions options_;
  FusionInputs inputs_;
  PlaneFusion::Keep keep_;
  bool pairs_;  // true if the shortcut applies
  // The second accumulator is for the shortcut.
  std::array<TileAccumulator, 2> accumulators_;
  std::optional<PlaneFusion> planes_;
  std::size_t pixels_ = 0;   // of the tile
  PlaneValues group_sum_;    // for the shortcut
  std::vector<bool> skips_;  // by slot: true if marks made it skip many pixels of this tile
  std::vector<std::uint64_t> units_;
};

/// The peaks and columns of one DSI on all tiles: the fused DSI, or one camera's. If there are
/// columns, the peaks have only the confidence.
class ViewPeaks {
 public:
  ViewPeaks(const DsiGrid& grid, int column_window, std::size_t tiles)
      : planes_(grid.planes.size()),
        column_window_(column_window),
        peaks_(unwrittenPeaks(grid.view, column_window > 0)),
        columns_(tiles) {}

  /// Returns the whole view after every tile is written. Its columns are moved out.
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
  /// @param max_pixels the largest number of pixels of a tile.
  TilePeaks(int planes, int column_window, std::size_t max_pixels)
      : columns_(column_window > 0), volume_(columns_ ? planes : 1, max_pixels) {}

  void moveTo(const cv::Rect& tile, VotingKernel kernel) {
    tile_ = tile;
    peaks_.emplace(static_cast<std::size_t>(tile.area()), kernel, !columns_);
  }
  /// Returns the memory of a plane, with kernels::kSumPadding: write its values, then `add` it.
  float* plane(int plane) { return volume_.plane(columns_ ? plane : 0); }
  /// Adds a plane. Planes are added in increasing order, without a gap; in any order with columns.
  void add(int plane) { peaks_->add(plane, this->plane(plane)); }
  void add(int plane, const PlaneValues& values) {
    peaks_->add(plane, values.data());
    if (columns_) volume_.setPlane(plane, values);
  }
  const RunningPeaks& peaks() const { return *peaks_; }
  /// Interpolates the planes that were not added. Needs columns. @param added one flag per plane.
  void interpolate(const std::vector<bool>& added) {
    volume_.interpolate(added, static_cast<std::size_t>(tile_.area()));
  }
  /// Writes the tile to its position in the view. Several threads may write different tiles.
  void writeTo(ViewPeaks& view, std::size_t tile) const {
    peaks_->writeTo(view.peaks_, tile_);
    if (!columns_) return;
    view.columns_[tile] = DsiColumns::select(tile_, view.peaks_.confidence(tile_), volume_,
                                             view.planes_, view.column_window_);
  }

 private:
  bool columns_;
  cv::Rect tile_;
  std::optional<RunningPeaks> peaks_;
  TileVolume volume_;  // without columns, of one plane
};

}  // namespace efm
