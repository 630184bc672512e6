// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

namespace efm {

/// Returns a number from its bytes, on any machine.
template <typename Number>
Number numberFrom(const void* bytes, bool big_endian) {
  static_assert(std::is_arithmetic_v<Number> || std::is_enum_v<Number>);
  std::array<char, sizeof(Number)> ordered;
  std::memcpy(ordered.data(), bytes, sizeof(Number));
  constexpr bool kBigEndianMachine = __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__;
  if (big_endian != kBigEndianMachine) std::reverse(ordered.begin(), ordered.end());
  Number number;
  std::memcpy(&number, ordered.data(), sizeof(Number));
  return number;
}

/// Writes a number with its lowest byte first, on any machine.
template <typename Number>
void writeLittleEndian(std::ostream& stream, Number number) {
  const auto ordered = numberFrom<Number>(&number, false);
  stream.write(reinterpret_cast<const char*>(&ordered), sizeof(Number));
}

/// Appends a number with its lowest byte first, on any machine.
template <typename Number>
void appendLittleEndian(std::string& bytes, Number number) {
  const auto ordered = numberFrom<Number>(&number, false);
  bytes.append(reinterpret_cast<const char*>(&ordered), sizeof(Number));
}

/// The types of numbers in files.
enum class NumberType {
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat32,
  kFloat64,
};

/// Calls `visit` with a zero of the type.
template <typename Visit>
auto withNumberOf(NumberType type, const Visit& visit) {
  switch (type) {
    case NumberType::kInt8:
      return visit(std::int8_t{});
    case NumberType::kUint8:
      return visit(std::uint8_t{});
    case NumberType::kInt16:
      return visit(std::int16_t{});
    case NumberType::kUint16:
      return visit(std::uint16_t{});
    case NumberType::kInt32:
      return visit(std::int32_t{});
    case NumberType::kUint32:
      return visit(std::uint32_t{});
    case NumberType::kInt64:
      return visit(std::int64_t{});
    case NumberType::kUint64:
      return visit(std::uint64_t{});
    case NumberType::kFloat32:
      return visit(float{});
    case NumberType::kFloat64:
      break;
  }
  return visit(double{});
}

inline std::size_t sizeOf(NumberType type) {
  return withNumberOf(type, [](auto number) { return sizeof(number); });
}

inline bool isReal(NumberType type) {
  return type == NumberType::kFloat32 || type == NumberType::kFloat64;
}

/// Returns the type of a kind and a size: 'i' signed integer, 'u' unsigned integer, 'f' real.
/// @return std::nullopt if there is no such type.
inline std::optional<NumberType> numberTypeOf(char kind, std::size_t bytes) {
  for (int k = 0; k <= static_cast<int>(NumberType::kFloat64); ++k) {
    const auto type = static_cast<NumberType>(k);
    const bool has_kind = withNumberOf(type, [kind](auto number) {
      using Number = decltype(number);
      return kind == (std::is_floating_point_v<Number> ? 'f'
                      : std::is_signed_v<Number>       ? 'i'
                                                       : 'u');
    });
    if (has_kind && sizeOf(type) == bytes) return type;
  }
  return std::nullopt;
}

/// Returns a number from its `sizeOf(type)` bytes.
inline double numberAt(const char* at, NumberType type, bool big_endian) {
  return withNumberOf(type, [&](auto zero) {
    return static_cast<double>(numberFrom<decltype(zero)>(at, big_endian));
  });
}

/// Numbers in memory at equal distances: a list, a column of a matrix, or a field of records.
struct Column {
  const char* first = nullptr;
  std::size_t stride = 0;  ///< Bytes from a number to the next number.
  NumberType type = NumberType::kFloat64;
  bool big_endian = false;

  /// Calls `take(i, number)` for i from 0 to count - 1, until it returns false. The number has the
  /// type of the file.
  /// @return the first i for which `take` returned false; `count` if it always returned true.
  template <typename Take>
  std::size_t forEach(std::size_t count, const Take& take) const {
    return withNumberOf(type, [&](auto zero) {
      const char* at = first;
      for (std::size_t i = 0; i < count; ++i, at += stride) {
        if (!take(i, numberFrom<decltype(zero)>(at, big_endian))) return i;
      }
      return count;
    });
  }
  double number(std::size_t i) const { return numberAt(first + i * stride, type, big_endian); }
};

/// Reader of consecutive values from bytes; owns nothing. If a value reaches beyond the end, it
/// throws a std::runtime_error that says how many bytes are missing.
class ByteReader {
 public:
  ByteReader(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}

  /// Aligns the next values to multiples of their size, counted from here, as in CDR.
  void alignFromHere() {
    origin_ = position_;
    aligned_ = true;
  }
  void setBigEndian(bool big_endian) { big_endian_ = big_endian; }

  template <typename T>
  T number() {
    if (aligned_) align(sizeof(T));
    return numberFrom<T>(take(sizeof(T)), big_endian_);
  }
  const std::uint8_t* take(std::size_t size) {
    if (size > remaining()) {
      throw std::runtime_error("the data ends at byte " + std::to_string(size_) + ": expected " +
                               std::to_string(size - remaining()) + " more bytes");
    }
    position_ += size;
    return data_ + position_ - size;
  }
  /// Returns the next bytes as text.
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

}  // namespace efm
