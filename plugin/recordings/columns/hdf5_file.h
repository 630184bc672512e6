// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "plugin/recordings/columns/chunk_filters.h"

namespace efm {

/// Owns an identifier of the HDF5 library. The library is not thread-safe: one thread at a time
/// calls it.
class Hdf5Id {
 public:
  using Close = herr_t (*)(hid_t);
  Hdf5Id() = default;
  Hdf5Id(hid_t id, Close close) : id_(id), close_(close) {}
  ~Hdf5Id() {
    if (id_ >= 0) close_(id_);
  }
  Hdf5Id(Hdf5Id&& other) noexcept
      : id_(std::exchange(other.id_, hid_t{H5I_INVALID_HID})), close_(other.close_) {}
  Hdf5Id& operator=(Hdf5Id&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }

  hid_t get() const { return id_; }
  bool valid() const { return id_ >= 0; }

 private:
  hid_t id_ = H5I_INVALID_HID;
  Close close_ = nullptr;
};

/// While it lives, the HDF5 library does not print its errors.
class Hdf5Quiet {
 public:
  Hdf5Quiet() {
    // At the process's end, the library would crash over a file that it could not write.
    static const herr_t no_exit_handler = H5dont_atexit();
    static_cast<void>(no_exit_handler);
    H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~Hdf5Quiet() { H5Eset_auto2(H5E_DEFAULT, print_, data_); }
  Hdf5Quiet(const Hdf5Quiet&) = delete;
  Hdf5Quiet& operator=(const Hdf5Quiet&) = delete;

 private:
  H5E_auto2_t print_ = nullptr;
  void* data_ = nullptr;
};

/// The cause of the last failed call as the library words it, in parentheses and with a blank in
/// front; empty if it has none.
std::string hdf5Cause();

/// An HDF5 file, open for reading. Paths of its objects begin with '/'.
class Hdf5File {
 public:
  explicit Hdf5File(std::filesystem::path file);

  const std::filesystem::path& path() const { return path_; }
  hid_t id() const { return id_.get(); }
  std::uint64_t bytes() const { return bytes_; }

  bool has(const std::string& path) const;
  /// @throws std::runtime_error naming the file and the data set if there is no such data set.
  Hdf5Id dataset(const std::string& path) const;
  /// All numbers of a small data set, row by row.
  /// @param count the expected number of numbers.
  /// @throws std::runtime_error naming the file, the data set and `expected`, its meaning.
  std::vector<double> numbers(const std::string& path, std::size_t count,
                              std::string_view expected) const;
  /// A whole number.
  std::int64_t integer(const std::string& path) const;
  /// The text of a data set.
  std::string text(const std::string& path) const;
  /// The text of an attribute of the file, if it has this attribute.
  std::optional<std::string> attribute(const char* name) const;

  /// "FILE:PATH: …".
  std::runtime_error fail(const std::string& path, std::string_view what) const;

 private:
  std::filesystem::path path_;
  Hdf5Id id_;
  std::uint64_t bytes_ = 0;
};

/// Consecutive rows of a data set in memory.
struct RowBlock {
  const std::uint8_t* data = nullptr;  ///< Of row `first`; valid until the next rows are read.
  std::uint64_t first = 0;
  std::uint64_t end = 0;  ///< The row behind the last one.
};

/// Reads a data set chunk by chunk. A row is the numbers, or the compound value, of one index of
/// the first dimension, as the file stores them. Memory is that of a chunk. Known filters are
/// undone here (see chunk_filters.h); others by the plugins of the HDF5 library.
class Hdf5Rows {
 public:
  /// @throws std::runtime_error naming the file and the data set if it does not exist, has no
  /// layout that can be read, a filter that is absent, or larger chunks than `kMaxChunkBytes`.
  Hdf5Rows(std::shared_ptr<const Hdf5File> file, std::string path);

  static constexpr std::uint64_t kMaxChunkBytes = std::uint64_t{1} << 27;

  const std::string& path() const { return path_; }
  std::uint64_t size() const { return size_; }
  /// The numbers of a row: the product of the other dimensions.
  std::size_t rowNumbers() const { return row_numbers_; }
  std::size_t rowBytes() const { return row_numbers_ * element_bytes_; }
  hid_t type() const { return type_.get(); }

  /// The chunk that contains a row.
  /// @param row below `size`.
  const RowBlock& blockAt(std::uint64_t row);

  std::runtime_error fail(std::string_view what) const { return file_->fail(path_, what); }
  std::runtime_error failAt(std::uint64_t row, std::string_view what) const;

 private:
  void readLayout();
  void readFilters(hid_t creation);
  void readChunks(std::uint64_t first_row);
  void readChunk(const std::vector<hsize_t>& offset);
  void placeChunk(const std::vector<hsize_t>& offset);
  void readSelection(std::uint64_t first_row, std::uint64_t rows);

  std::shared_ptr<const Hdf5File> file_;
  std::string path_;
  Hdf5Id set_;
  Hdf5Id type_;
  std::size_t element_bytes_ = 0;
  std::vector<hsize_t> sides_;        // of the data set
  std::vector<hsize_t> chunk_sides_;  // of a chunk, or of a block of rows
  std::uint64_t chunk_bytes_ = 0;
  std::uint64_t size_ = 0;
  std::size_t row_numbers_ = 1;
  bool direct_ = false;  // chunks are read without the library's filters
  std::vector<ChunkFilter> filters_;

  RowBlock block_;
  std::vector<std::uint8_t> rows_;  // of the block
  std::vector<std::uint8_t> chunk_;
  std::vector<std::uint8_t> scratch_;
};

/// A number of each row: a data set of its own, a column of a matrix, or a field of a compound
/// value.
class Hdf5Column {
 public:
  /// @param index of the number in the row of a matrix.
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
