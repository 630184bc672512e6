// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/evaluation/image_numbers.h"

#include <cstring>

namespace efm {
namespace {

/// The bytes as an unsigned number, whatever the order of the machine's own.
template <typename Unsigned>
Unsigned unsignedAt(std::string_view bytes, bool big_endian) {
  Unsigned value = 0;
  for (std::size_t k = 0; k < sizeof(Unsigned); ++k) {
    const std::size_t place = big_endian ? k : sizeof(Unsigned) - 1 - k;
    value = static_cast<Unsigned>((value << 8) | static_cast<unsigned char>(bytes[place]));
  }
  return value;
}

template <typename Value, typename Unsigned>
Value valueAt(std::string_view bytes, bool big_endian) {
  static_assert(sizeof(Value) == sizeof(Unsigned));
  const auto bits = unsignedAt<Unsigned>(bytes, big_endian);
  Value value = 0;
  std::memcpy(&value, &bits, sizeof(value));
  return value;
}

}  // namespace

float numberAt(std::string_view bytes, std::size_t index, const NumberLayout& layout) {
  const std::string_view place = bytes.substr(index * layout.bytes(), layout.bytes());
  if (layout.is_double) {
    return static_cast<float>(valueAt<double, std::uint64_t>(place, layout.big_endian));
  }
  return valueAt<float, std::uint32_t>(place, layout.big_endian);
}

}  // namespace efm
