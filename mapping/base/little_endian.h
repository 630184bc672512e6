// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <ostream>

namespace efm {

/// Writes a number with its lowest byte first, on any machine.
template <typename Number>
void writeLittleEndian(std::ostream& stream, Number number) {
  constexpr std::uint16_t kOne = 1;
  std::array<char, sizeof(Number)> bytes = {};
  std::memcpy(bytes.data(), &number, sizeof(Number));
  char first = 0;
  std::memcpy(&first, &kOne, 1);
  if (first != 1) std::reverse(bytes.begin(), bytes.end());
  stream.write(bytes.data(), bytes.size());
}

}  // namespace efm
