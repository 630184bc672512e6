// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "mapping/kernels/kernels.h"

namespace efm::kernels {

// Votes on one tile of one depth plane. A tile is small enough to stay in the first-level cache.
//
// A vote falls into the cell between four pixels: cell (x, y) is the square from pixel (x, y) to
// (x + 1, y + 1). A cell sums the weights of its votes for each of these pixels, in units of
// 1/1024. The four sums are packed into 64 bits, so a vote is one addition:
//
//   bits  0 to 15: the upper left pixel        bits 32 to 47: the upper right pixel
//   bits 16 to 31: the lower left pixel        bits 48 to 63: the lower right pixel
//
// The four weights of a vote sum to 1024. A sum that reaches 2^15 makes its cell full: the cell is
// copied to a list and set to zero, before any sum can overflow its 16 bits.

inline constexpr int kTileCells = 64;     ///< Maximum cells per side of a tile, and the row stride.
inline constexpr int kFractionBits = 12;  ///< Bits of a coordinate within its cell.
inline constexpr int kWeightBits = 10;    ///< Bits of a weight; a vote has 2^kWeightBits units.
inline constexpr int kVotesPerCell = 32;  ///< A full cell has at least this number of votes.

/// The sums of a cell's weights for each pixel, in units of 1/1024 of a vote.
struct CellSums {
  std::uint32_t upper_left = 0, lower_left = 0, upper_right = 0, lower_right = 0;
};

inline CellSums unpack(std::uint64_t cell) {
  const auto field = [cell](int first) {
    return static_cast<std::uint32_t>(cell >> first & 0xFFFFU);
  };
  return {field(0), field(16), field(32), field(48)};
}

/// The origin of rays' coordinates is a multiple of this number of pixels, and adjacent tiles share
/// it. A vote on the border of two tiles is then rounded equally in both, and counted once. Up to
/// this distance plus one tile, a float holds a coordinate in 1/4096 px exactly. In wider views the
/// origin changes between some tiles. There, a few of 10^8 votes are counted twice or not at all;
/// their weights are right.
inline constexpr int kSharedOrigin = 31 * kTileCells;
static_assert((kSharedOrigin + kTileCells) << kFractionBits <= 1 << 23);
/// Vectors may read and write this number of elements past the end of a tile's rays.
inline constexpr std::size_t kRayPadding = 64;

/// A ray of a bin: its pixel on an anchor plane, and its shift in pixels per 1/m of inverse depth.
struct BinnedRay {
  float x, y;
  float dx, dy;
};

/// A request for the rays that a tile needs. Values in 1/m are differences of inverse depth.
struct GatherRequest {
  float to_first = 0, to_last = 0;  ///< From the anchor plane to the first and last plane, 1/m.
  float to_pixels = 0;  ///< From the anchor plane to the plane of the gathered pixels, 1/m.
  float moving = 1;     ///< 1; or 0 for a single plane: the shifts of its rays become zero.
  float left = 0, right = 0, top = 0, bottom = 0;  ///< Borders of the tile's cells, pixels.
  float origin_x = 0, origin_y = 0;                ///< Origin of the gathered coordinates, pixels.
};

/// Rays that a tile may see in a group of planes, as four arrays: their pixels on one plane (1/4096
/// px) and their shifts (1/4096 px per 1/m). Pixels and shifts do not depend on the group or the
/// tile, so a ray's vote has the same bits in all groups and tiles.
struct MovingRays {
  float* x = nullptr;
  float* y = nullptr;
  float* dx = nullptr;
  float* dy = nullptr;
  std::size_t size = 0;
};

/// Cells of a line. A line is a part of a row.
inline constexpr int kLineCells = 8;
inline constexpr int kLines = kTileCells * (kTileCells + 2) / kLineCells;

/// A tile's cells in rows of kTileCells, with two rows more than votes need.
struct CellBuffer {
  std::uint64_t* cells = nullptr;
  /// A flag for each of kLines lines: 1 if the line may have votes, else 0. Null: no flags.
  std::uint8_t* dirty = nullptr;
};

/// The cells of a tile into which votes may fall.
struct CellWindow {
  CellBuffer tile;
  std::uint32_t first = 0;         ///< Index of the window's first cell in the tile.
  std::int32_t left = 0, top = 0;  ///< Position of that cell from the rays' origin, pixels.
  std::uint32_t columns = 0, rows = 0;
};

/// A copy of a full cell.
struct FullCell {
  std::uint32_t index = 0;  ///< Index in the tile.
  std::uint64_t sums = 0;
};

struct TileFunctions {
  /// Appends the rays of bins that come near the tile between the request's first and last plane.
  /// @param bin `count` rays, followed by memory for one vector of rays.
  /// @param rays arrays with memory for `count` more rays and the padding. @return the new size.
  std::size_t (*gather)(const BinnedRay* bin, std::size_t count, const GatherRequest& request,
                        const MovingRays& rays) = nullptr;
  /// Votes at the pixels where the rays meet a plane, `to_plane` (1/m) from the plane of `rays`.
  /// @param full receives full cells; has memory for one cell per kVotesPerCell rays. @return one
  /// past the last full cell. Afterwards no sum of a cell is 2^15 or more.
  FullCell* (*vote)(const MovingRays& rays, float to_plane, const CellWindow& window,
                    FullCell* full) = nullptr;
};

/// @param kernel one of `availableKernels`, but not plain: it needs no tiles.
const TileFunctions& tileFunctions(VotingKernel kernel);

/// Turns the cells of a tile into its ray densities: the bilinear votes of Ghosh and Gallego 2022,
/// Eq. 2. The first pixel is right of and below the first cell. A tile has at most kTileCells - 1
/// pixels per side. All cells are zero afterwards.
struct ResolveFunctions {
  /// @param values width x height, row-major.
  /// @return the sum of all pixels' weights, in units: a vote has 2^kWeightBits.
  std::uint64_t (*all)(std::uint64_t* cells, int width, int height, float* values) = nullptr;

  /// Adds the mean of two inputs' densities to a sum, without storing the densities. If lines are
  /// marked in both inputs, lines without votes are skipped; bits are the same. Marks are cleared.
  /// @param sum width x height, row-major, with kSumPadding. @param units the sum of the pixels'
  /// weights of each input is added to it.
  /// @return the number of pixels that were not skipped.
  using AddPair = int (*)(const CellBuffer& first, const CellBuffer& second, int width, int height,
                          float* sum, std::uint64_t units[2]);
  AddPair addMin = nullptr;
  AddPair addHarmonic = nullptr;
  AddPair addGeometric = nullptr;
};

/// @param kernel one of `availableKernels`, but not plain: it needs no tiles.
const ResolveFunctions& resolveFunctions(VotingKernel kernel);

}  // namespace efm::kernels
