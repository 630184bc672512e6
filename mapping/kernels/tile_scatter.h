// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "mapping/kernels/instruction_set.h"
#include "mapping/kernels/tile_pixels.h"

namespace efm::kernels {

// Votes on one tile of one depth plane, small enough to stay in the first-level cache.
//
// A vote falls into the cell between four pixels: cell (x, y) is the square from pixel (x, y) to
// (x + 1, y + 1). Its four bilinear weights are linear in 1, a, b and ab, where (a, b) is the place
// in the cell. A cell therefore sums these four, packed into 64 bits, and a vote is one addition;
// the weights of all votes are worked out once per cell and plane (`tile_fold.h`):
//
//   bits  0 to 17: sum of a, in 1/4096        bits 36 to 56: sum of ab, in 1/32,768
//   bits 18 to 35: sum of b, in 1/4096        bits 57 to 63: number of votes
//
// The number reaches the top bit with the 64th vote, when no sum can have left its field yet: a
// cell whose sign changes is full. It is put aside and begins anew.

inline constexpr int kFractionBits = 12;  ///< Of a coordinate within its cell.
inline constexpr int kProductBits = 15;   ///< Of the product of two.
inline constexpr int kVotesPerCell = 64;  ///< After so many a cell is full.

/// A cell's sums, in the units above.
struct CellSums {
  std::uint32_t a = 0, b = 0, ab = 0, votes = 0;
};

inline constexpr int kSumBits = 18;  ///< Of the sum of a, and of b.
inline constexpr int kProductShift =
    2 * kSumBits - 32;                       ///< Of the sum of ab, in the upper 32 bits,
inline constexpr int kCountShift = 57 - 32;  ///< and of the number of votes.

inline CellSums unpack(std::uint64_t cell) {
  const auto field = [cell](int first, int end) {
    return static_cast<std::uint32_t>(cell >> first & ((std::uint64_t{1} << (end - first)) - 1));
  };
  return {field(0, kSumBits), field(kSumBits, 2 * kSumBits),
          field(32 + kProductShift, 32 + kCountShift), field(32 + kCountShift, 64)};
}

/// Coordinates count from a pixel that neighbouring tiles share, so that a vote on the border of
/// two rounds alike in both and is counted once: a multiple of this. So far from it, and a tile
/// farther, a coordinate in 1/4096 px still is a float's whole number. In wider views a few in 10^8
/// votes are counted twice or not at all where the origin changes; their weights are right.
inline constexpr int kSharedOrigin = 31 * kTileCells;
static_assert((kSharedOrigin + kTileCells) << kFractionBits <= 1 << 23);
/// Vectors may read and write so many elements past the end of the rays of a tile.
inline constexpr std::size_t kRayPadding = 64;

/// A ray of a bin: where it meets the home plane, in 1/4096 px from the bin's corner, and how its
/// shift differs from the bins' common one, in their own unit.
struct CompactRay {
  std::uint16_t x;
  std::uint16_t y;
  std::int16_t dx;
  std::int16_t dy;
};

/// What to look for in a bin. A ray that meets the home plane at (u, v) from the principal point
/// moves by (a - c u + step_x dx, b - c v + step_y dy) pixels per unit of inverse depth.
struct GatherRequest {
  float corner_x = 0, corner_y = 0;  ///< The bin's corner, pixels of the view.
  float cx = 0, cy = 0;              ///< The view's principal point.
  float a = 0, b = 0, c = 0;
  float step_x = 0, step_y = 0;
  float to_first = 0, to_last = 0;  ///< From the home plane to the group's first and last, 1/m.
  float left = 0, right = 0, top = 0, bottom = 0;  ///< The tile's cells, pixels.
  float origin_x = 0, origin_y = 0;                ///< What the gathered coordinates count from.
};

/// Rays that a tile may see in a group of planes, as four arrays: where they meet the home plane
/// and their shift per inverse depth, in 1/4096 px. Neither depends on the group or the tile: a
/// ray's votes are the same bits in every one.
struct TileRays {
  float* x = nullptr;
  float* y = nullptr;
  float* dx = nullptr;
  float* dy = nullptr;
  std::size_t size = 0;
};

/// A line of cells, eight of a row, begins on a cache line and has a mark.
inline constexpr int kLineCells = 8;
inline constexpr int kMarks = kTileCells * (kTileCells + 2) / kLineCells;

/// A tile's cells in rows of kTileCells, with two rows more than votes may fall into.
struct MarkedCells {
  std::uint64_t* cells = nullptr;
  /// Not zero for each line that votes may have fallen into: kMarks and the padding of rays.
  std::uint8_t* marks = nullptr;
};

/// The cells of a tile that votes may fall into.
struct CellWindow {
  MarkedCells tile;
  std::uint32_t first = 0;         ///< Which of the tile's cells is the window's first.
  std::int32_t left = 0, top = 0;  ///< Its place, counted as the rays' coordinates are.
  std::uint32_t columns = 0, rows = 0;
};

/// A full cell that was put aside.
struct FullCell {
  std::uint32_t index = 0;  ///< Of the tile's cells.
  std::uint64_t sums = 0;
};

struct TileFunctions {
  /// Appends the rays of a bin that come near the tile between the two planes.
  /// @param rays with room for `count` more, and the padding. @return their new number.
  std::size_t (*gather)(const CompactRay* bin, std::size_t count, const GatherRequest& request,
                        const TileRays& rays) = nullptr;
  /// Votes where the rays meet the plane that is `to_plane` (1/m) from the home plane.
  /// @param full with room for one of every kVotesPerCell rays. @return one past the last put
  /// aside.
  FullCell* (*vote)(const TileRays& rays, float to_plane, const CellWindow& window,
                    FullCell* full) = nullptr;
};

/// @param kernel one of `runnableKernels`, but not the plain one, which needs no tiles.
const TileFunctions& tileFunctions(VotingKernel kernel);

}  // namespace efm::kernels
