// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "mapping/kernels/instruction_set.h"
#include "mapping/kernels/tile_scatter.h"

namespace efm::kernels {

inline constexpr int kBlockPixels = 16;
inline constexpr int kBlocksInRow = kTileCells / kBlockPixels;

/// Pixels of a tile, which has at most kTileCells - 1 on a side: bit x of a row is pixel x.
struct TilePixels {
  int width = 0;  ///< Of the tile.
  int height = 0;
  std::uint64_t rows[kTileCells] = {};

  void intersect(const TilePixels& others) {
    for (int y = 0; y < height; ++y) rows[y] &= others.rows[y];
  }
};

/// Blocks of a tile: kBlockPixels of a row each.
struct PixelBlocks {
  int width = 0;  ///< Of the tile.
  int height = 0;
  std::size_t size = 0;
  /// Ascending: kBlocksInRow * y + x / kBlockPixels. Vectors may write past the last.
  std::uint32_t blocks[kTileCells * (kBlocksInRow + 1)];
};

/// The lines of a tile's cells that may have votes.
struct DirtyLines {
  std::size_t size = 0;
  /// Ascending. Vectors may write past the last.
  std::uint32_t lines[kDirtyFlags + kLineCells * 2];
};

/// From the cells of a tile (`tile_scatter.h`) to its ray densities: the bilinear votes of Ghosh
/// and Gallego 2022, Eq. 2. A tile's pixels lie right of and below its first cells.
struct ResolveFunctions {
  /// Resolves all pixels and clears the cells and their dirty flags.
  /// @param values width x height, row-major.
  /// @return the votes of the cells whose upper left pixel lies in the tile.
  std::uint64_t (*all)(const CellBuffer& cells, int width, int height, float* values) = nullptr;

  // Where most cells are empty, four steps that skip them are faster. Values have the same bits.

  /// Finds the pixels adjacent to a cell with votes. @param pixels width and height are given.
  /// @return the votes as above.
  std::uint64_t (*findOccupied)(const CellBuffer& cells, TilePixels& pixels,
                                DirtyLines& lines) = nullptr;
  /// Lists the blocks that hold any of the pixels.
  void (*listBlocks)(const TilePixels& pixels, PixelBlocks& blocks) = nullptr;
  /// Resolves the pixels of some blocks. @param values as above; right in the blocks alone.
  void (*blocks)(const std::uint64_t* cells, const PixelBlocks& blocks, float* values) = nullptr;
  /// Clears the cells of some lines and all dirty flags.
  void (*clear)(const CellBuffer& cells, const DirtyLines& lines) = nullptr;
};

/// @param kernel one of `availableKernels`, but not the plain one, which needs no tiles.
const ResolveFunctions& resolveFunctions(VotingKernel kernel);

}  // namespace efm::kernels
