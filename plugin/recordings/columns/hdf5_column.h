// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <utility>

#include "plugin/recordings/columns/hdf5_rows.h"

namespace efm {

/// A number of each row: a data set of its own, a column of a matrix, or a field of a compound
/// value.
class Hdf5Column {
 public:
  /// @param index of the number in the row of a matrix.
  /// @throws std::runtime_error naming the file and the data set if the row has no such number.
  static Hdf5Column ofMatrix(std::shared_ptr<Hdf5Rows> rows, std::size_t index);
  /// @throws std::runtime_error naming the file, the data set and the field if there is no such
  /// field, or it is no number.
  static Hdf5Column ofField(std::shared_ptr<Hdf5Rows> rows, const std::string& field);

  std::uint64_t size() const { return rows_->size(); }
  /// Whether the numbers are float or double.
  bool isReal() const { return type_ == Type::kFloat || type_ == Type::kDouble; }
  Hdf5Rows& rows() const { return *rows_; }

  /// Calls `take(i, number)` for the rows first + i, i from 0 to count - 1, up to the first one
  /// for which it returns false. The number has the type of the file. The rows must lie in one
  /// block.
  /// @return the first i that was refused; `count` if none was.
  template <typename Take>
  std::size_t forEach(std::uint64_t first, std::size_t count, const Take& take) const {
    switch (type_) {
      case Type::kUint8:
        return loop<std::uint8_t>(first, count, take);
      case Type::kInt8:
        return loop<std::int8_t>(first, count, take);
      case Type::kUint16:
        return loop<std::uint16_t>(first, count, take);
      case Type::kInt16:
        return loop<std::int16_t>(first, count, take);
      case Type::kUint32:
        return loop<std::uint32_t>(first, count, take);
      case Type::kInt32:
        return loop<std::int32_t>(first, count, take);
      case Type::kUint64:
        return loop<std::uint64_t>(first, count, take);
      case Type::kInt64:
        return loop<std::int64_t>(first, count, take);
      case Type::kFloat:
        return loop<float>(first, count, take);
      case Type::kDouble:
        break;
    }
    return loop<double>(first, count, take);
  }

 private:
  enum class Type {
    kUint8,
    kInt8,
    kUint16,
    kInt16,
    kUint32,
    kInt32,
    kUint64,
    kInt64,
    kFloat,
    kDouble
  };

  Hdf5Column(std::shared_ptr<Hdf5Rows> rows, std::size_t offset, Type type)
      : rows_(std::move(rows)), offset_(offset), type_(type) {}
  static Type typeOf(const Hdf5Rows& rows, hid_t type);

  template <typename Number, typename Take>
  std::size_t loop(std::uint64_t first, std::size_t count, const Take& take) const {
    const std::size_t stride = rows_->rowBytes();
    const RowBlock& block = rows_->blockAt(first);
    const std::uint8_t* from = block.data + (first - block.first) * stride + offset_;
    for (std::size_t i = 0; i < count; ++i, from += stride) {
      Number number;
      std::memcpy(&number, from, sizeof(Number));
      if (!take(i, number)) return i;
    }
    return count;
  }

  std::shared_ptr<Hdf5Rows> rows_;
  std::size_t offset_;
  Type type_;
};

}  // namespace efm
