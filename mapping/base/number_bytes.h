// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <ostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

namespace efm {

/// Reads values from bytes one after the other. A value beyond the end is a std::runtime_error that
/// says how many bytes are missing. Owns nothing.
class ByteReader {
 public:
  ByteReader(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}

  /// Values are at multiples of their size from here on, as in CDR.
  void alignFromHere() {
    origin_ = position_;
    aligned_ = true;
  }
  void setBigEndian(bool big_endian) { big_endian_ = big_endian; }

  template <typename T>
  T number() {
    static_assert(std::is_arithmetic_v<T>);
    if (aligned_) align(sizeof(T));
    std::array<std::uint8_t, sizeof(T)> bytes;
    std::memcpy(bytes.data(), take(sizeof(T)), sizeof(T));
    if (big_endian_) std::reverse(bytes.begin(), bytes.end());
    T value;
    std::memcpy(&value, bytes.data(), sizeof(T));
    return value;
  }
  const std::uint8_t* take(std::size_t size) {
    if (size > remaining()) {
      throw std::runtime_error("the data ends at byte " + std::to_string(size_) + ": expected " +
                               std::to_string(size - remaining()) + " more bytes");
    }
    position_ += size;
    return data_ + position_ - size;
  }
  /// Bytes as text.
  std::string_view text(std::size_t size) {
    return {reinterpret_cast<const char*>(take(size)), size};
  }
  /// Skips bytes to a multiple of `size` from the origin.
  void align(std::size_t size) {
    const std::size_t over = (position_ - origin_) % size;
    if (over > 0) take(size - over);
  }

  std::size_t position() const { return position_; }
  std::size_t remaining() const { return size_ - position_; }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t position_ = 0;
  std::size_t origin_ = 0;
  bool aligned_ = false;
  bool big_endian_ = false;
};

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
