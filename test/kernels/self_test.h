// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mapping/kernels/kernels.h"
#include "mapping/kernels/tile_scatter.h"

namespace efm::kernels {

/// What a self-test calls.
struct TestedFunctions {
  TileFunctions tile;  ///< Null, with `resolve`, for the plain kernel, which has no tiles.
  ResolveFunctions resolve;
  PeakFunctions peaks;
  ColumnFunctions columns;
  RankFunctions ranks;

  /// @param kernel one of `availableKernels`.
  static TestedFunctions of(VotingKernel kernel);
};

/// Compares functions with plain code, on a small random input. Takes some milliseconds.
/// @return what differs, one line each; empty where nothing does.
std::vector<std::string> selfTest(const TestedFunctions& functions, std::uint32_t seed = 1);

}  // namespace efm::kernels
