// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

namespace efm {

/// Appends a number as the machine has it: little-endian.
template <typename T>
void appendNumber(std::string& bytes, T value) {
  static_assert(std::is_arithmetic_v<T>);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

/// A ROS 2 message in CDR: values at multiples of their size from the end of the header of 4 bytes.
class CdrWriter {
 public:
  template <typename T>
  CdrWriter& number(T value) {
    const std::size_t over = (bytes_.size() - kHeader) % sizeof(T);
    if (over > 0) bytes_.append(sizeof(T) - over, '\0');
    appendNumber(bytes_, value);
    return *this;
  }
  /// Ends with a zero.
  CdrWriter& text(std::string_view text) {
    number(static_cast<std::uint32_t>(text.size() + 1));
    bytes_.append(text).push_back('\0');
    return *this;
  }
  /// The whole message, also to append bytes.
  std::string& bytes() { return bytes_; }

 private:
  static constexpr std::size_t kHeader = 4;
  std::string bytes_ = std::string("\0\1\0\0", kHeader);  // little-endian
};

}  // namespace efm
