// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "maps/io/point_record.h"

namespace efm {

/// What precedes the numbers of a NumPy array (.npy; NEP 1, format 1.0 to 3.0).
struct NpyHeader {
  std::string descr;                       ///< The type as the file has it: "<f4".
  NumberType type = NumberType::kFloat32;  ///< Booleans are kUint8.
  bool big_endian = false;
  std::vector<std::uint64_t> shape;  ///< Empty for a single number.
  std::size_t data_begin = 0;        ///< Bytes before the numbers.

  std::uint64_t count() const;  ///< Of all numbers; at most 2^53.
  std::uint64_t bytes() const { return count() * sizeOf(type); }
};

/// Whether these are the first bytes of a NumPy array.
bool looksLikeNpy(std::string_view bytes);

/// Parses the header of an array in C order.
/// @param bytes the beginning of the file; 64 KiB contain any header of an array of numbers.
/// @throws std::runtime_error "the array's header: …" naming the wrong part, its value and the
/// expected one: no array, Fortran order, or something else than numbers, such as Python objects.
NpyHeader parseNpyHeader(std::string_view bytes);

}  // namespace efm
