// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

namespace efm::kernels {

inline constexpr int kTileCells = 64;  ///< Cells on a side of a tile at most; a row's stride.
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

/// The blocks of kBlockPixels in a row of a tile that hold any of some pixels.
struct PixelBlocks {
  int width = 0;  ///< Of the tile.
  int height = 0;
  std::size_t size = 0;
  /// Ascending: kBlocksInRow * y + x / kBlockPixels. Vectors may write past the last.
  std::uint32_t blocks[kTileCells * (kBlocksInRow + 1)];
};

}  // namespace efm::kernels
