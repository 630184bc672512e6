// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string_view>

namespace efm {

/// How numbers lie in a file of them.
struct NumberLayout {
  bool big_endian = false;
  bool is_double = false;  ///< float64, else float32.

  std::size_t bytes() const { return is_double ? 8 : 4; }
};

/// Number `index` of a row of numbers; doubles are rounded to float.
/// @param bytes reach beyond that number.
float numberAt(std::string_view bytes, std::size_t index, const NumberLayout& layout);

/// Images larger than this are taken for a damaged header.
inline constexpr std::uint64_t kMaxImageSide = 65535;

}  // namespace efm
