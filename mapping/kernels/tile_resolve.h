// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "mapping/kernels/instruction_set.h"
#include "mapping/kernels/tile_pixels.h"
#include "mapping/kernels/tile_scatter.h"

namespace efm::kernels {

/// The lines of a tile's cells that votes may have fallen into.
struct MarkedLines {
  std::size_t size = 0;
  std::uint32_t lines[kMarks + kLineCells * 2];  ///< Ascending. Vectors may write past the last.
};

/// From the cells of a tile (`tile_vote.h`) to its ray densities.
struct FoldFunctions {
  /// Those of all pixels, which lie right of and below the first cells. Clears cells and marks.
  /// @param values width x height, row-major.
  /// @return the votes of the cells right of and below the first ones.
  std::uint64_t (*all)(const MarkedCells& cells, int width, int height, float* values) = nullptr;

  // Where most cells are empty it is faster to look for the others, in four steps. Each value is
  // the same bits.

  /// Finds what a vote falls on. @param pixels of which tile; then, those that have a vote.
  /// @return the votes of the cells right of and below the first ones.
  std::uint64_t (*find)(const MarkedCells& cells, TilePixels& pixels, MarkedLines& lines) = nullptr;
  void (*listBlocks)(const TilePixels& pixels, PixelBlocks& blocks) = nullptr;
  /// @param values as above, right in the blocks alone.
  void (*some)(const std::uint64_t* cells, const PixelBlocks& blocks, float* values) = nullptr;
  /// Clears cells and marks.
  void (*clear)(const MarkedCells& cells, const MarkedLines& lines) = nullptr;
};

/// @param kernel one of `runnableKernels`, but not the plain one, which needs no tiles.
const FoldFunctions& foldFunctions(VotingKernel kernel);

}  // namespace efm::kernels
