// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "mapping/base/number_bytes.h"

namespace efm {

/// A field of a structured array that is a number.
struct NpyField {
  std::string name;
  NumberType type = NumberType::kFloat32;
  bool big_endian = false;
  std::size_t offset = 0;  ///< Bytes from the beginning of the element.
};

/// The header of a NumPy array (.npy; NEP 1, format 1.0 to 3.0).
struct NpyHeader {
  std::string descr;                       ///< The type as written in the file: "<f4".
  NumberType type = NumberType::kFloat32;  ///< Booleans are kUint8.
  bool big_endian = false;
  /// The fields of a structured array that are numbers; its `type` has no meaning.
  std::vector<NpyField> fields;
  bool structured = false;
  bool fortran_order = false;
  std::size_t element_bytes = 0;
  std::vector<std::uint64_t> shape;  ///< Empty for a single number.
  std::size_t data_begin = 0;        ///< Bytes before the numbers.

  std::uint64_t count() const;                                     ///< Number of all elements.
  std::uint64_t bytes() const { return count() * element_bytes; }  ///< Below 2^60.
};

/// Returns whether these are the first bytes of a NumPy array.
bool looksLikeNpy(std::string_view bytes);

/// Parses the header of an array of numbers, or of structures with numbers.
/// @param bytes the beginning of the file; 64 KiB contain any header of an array of numbers.
NpyHeader parseNpyHeader(std::string_view bytes);

/// @throws std::runtime_error as `parseNpyHeader`, for structures, and for arrays that are not
/// stored row after row.
void requirePlainRows(const NpyHeader& header);

}  // namespace efm
