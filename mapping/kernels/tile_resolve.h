// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "mapping/kernels/instruction_set.h"
#include "mapping/kernels/tile_scatter.h"

namespace efm::kernels {

/// Vectors may read, and write back, this number of values past the end of a sum.
inline constexpr std::size_t kSumPadding = 16;

/// From the cells of a tile (`tile_scatter.h`) to its ray densities: the bilinear votes of Ghosh
/// and Gallego 2022, Eq. 2. A tile's pixels lie right of and below its first cells; it has at most
/// kTileCells - 1 on a side. All cells are zero afterwards.
struct ResolveFunctions {
  /// @param values width x height, row-major.
  /// @return the sum of all pixels' weights, in units: 2^kWeightBits are a vote.
  std::uint64_t (*all)(std::uint64_t* cells, int width, int height, float* values) = nullptr;

  /// Adds the mean of two inputs' densities to a sum, without densities in memory. Where votes are
  /// marked, in both inputs, lines without votes are skipped; bits are the same. No mark is left.
  /// @param sum as `values` above, with padding. @param units receives the pixels' weights of each
  /// input, added.
  /// @return the number of pixels that were not skipped.
  using AddPair = int (*)(const CellBuffer& first, const CellBuffer& second, int width, int height,
                          float* sum, std::uint64_t units[2]);
  AddPair addMin = nullptr;
  AddPair addHarmonic = nullptr;
  AddPair addGeometric = nullptr;
};

/// @param kernel one of `availableKernels`, but not the plain one, which needs no tiles.
const ResolveFunctions& resolveFunctions(VotingKernel kernel);

}  // namespace efm::kernels
