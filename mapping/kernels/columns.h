// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "mapping/kernels/instruction_set.h"

namespace efm::kernels {

/// Vectors may read and write this number of values past the end of a column or a sum.
inline constexpr std::size_t kColumnPadding = 16;

/// Arithmetic on columns of the DSI: the values of a pixel on all planes.
struct ColumnFunctions {
  /// sum[plane] += unit * values[plane]; also in the padding, where sums mean nothing.
  void (*add)(float* sum, const std::uint16_t* values, std::size_t planes, float unit) = nullptr;
};

/// @param kernel one of `availableKernels`. All of them give the bits of the plain one.
const ColumnFunctions& columnFunctions(VotingKernel kernel);

}  // namespace efm::kernels
