// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "mapping/kernels/instruction_set.h"

namespace efm::kernels {

/// Vectors may read and write this number of values past the end of a column or a sum.
inline constexpr std::size_t kColumnPadding = 16;

/// A column stores the root of the distance of each value below the column's peak, in a byte: steps
/// are fine near the peak, which decides on the depth, and coarse (1/128 of the peak) near zero.
inline constexpr int kMaxRoot = 255;                       ///< Stands for 0.
inline constexpr float kColumnPeak = kMaxRoot * kMaxRoot;  ///< A column's peak, in its units.
/// The value that a root stands for, in units of the column.
inline float columnValue(std::uint8_t root) {
  return kColumnPeak - static_cast<float>(int{root} * int{root});
}

/// Arithmetic on columns of the DSI: the values of a pixel on all planes.
struct ColumnFunctions {
  /// sum[plane] += unit * columnValue(roots[plane]); also in the padding, where sums mean nothing.
  void (*add)(float* sum, const std::uint8_t* roots, std::size_t planes, float unit) = nullptr;
};

/// @param kernel one of `availableKernels`. All of them give the bits of the plain one.
const ColumnFunctions& columnFunctions(VotingKernel kernel);

}  // namespace efm::kernels
