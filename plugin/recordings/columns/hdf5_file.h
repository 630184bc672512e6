// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "plugin/recordings/columns/chunk_filters.h"
#include "plugin/recordings/columns/event_table.h"

namespace efm {

/// Owns an identifier of the HDF5 library. The library is not thread-safe: only one thread at a
/// time may call it.
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

/// While this object exists, the HDF5 library does not print its errors.
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

/// Returns the library's text for the cause of the last failed call, as " (CAUSE)"; empty if there
/// is none.
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
  /// Reads all numbers of a small data set, row by row.
  /// @param count the expected number of numbers.
  /// @throws std::runtime_error naming the file, the data set and `expected`, the numbers' meaning.
  std::vector<double> numbers(const std::string& path, std::size_t count,
                              std::string_view expected) const;
  /// Reads a data set with one whole number.
  std::int64_t integer(const std::string& path) const;
  std::string text(const std::string& path) const;
  /// Reads the text of an attribute of the file; std::nullopt if the file does not have it.
  std::optional<std::string> attribute(const char* name) const;

  /// Makes the error "FILE:PATH: …".
  std::runtime_error fail(const std::string& path, std::string_view what) const;

 private:
  bool readAll(const std::string& path, hid_t type, std::size_t count, void* to) const;

  std::filesystem::path path_;
  Hdf5Id id_;
  std::uint64_t bytes_ = 0;
};

/// Reads a data set chunk by chunk. A row has the numbers, or the compound value, of one index of
/// the first dimension, as stored in the file. Memory holds one chunk. Known filters are undone
/// here (see chunk_filters.h), other filters by the plugins of the HDF5 library.
class Hdf5Rows : public NumberRows {
 public:
  /// @throws std::runtime_error naming the file and the data set if the data set does not exist,
  /// its layout cannot be read, a filter is missing, or chunks are larger than `kMaxChunkBytes`.
  Hdf5Rows(std::shared_ptr<const Hdf5File> file, std::string path);

  static constexpr std::uint64_t kMaxChunkBytes = std::uint64_t{1} << 27;

  const std::string& path() const { return path_; }
  /// The number of numbers in a row: the product of all dimensions but the first.
  std::size_t rowNumbers() const { return row_numbers_; }
  std::string placeOf(std::uint64_t row) const override;
  std::runtime_error fail(std::string_view what) const { return file_->fail(path_, what); }

  /// Returns a column of a list or a matrix.
  /// @param index index of the number in a row; 0 for a list.
  static RowColumn ofMatrix(std::shared_ptr<Hdf5Rows> rows, std::size_t index);
  /// Returns a field of compound values as a column.
  /// @throws std::runtime_error naming the file, the data set and the field if there is no such
  /// field, or it is no number.
  static RowColumn ofField(std::shared_ptr<Hdf5Rows> rows, const std::string& field);

 private:
  RowBlock readBlock(std::uint64_t row) override;
  NumberType numberType(hid_t type) const;
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
  std::vector<hsize_t> sides_;        // size of each dimension of the data set
  std::vector<hsize_t> chunk_sides_;  // size of a chunk, or of a block of rows
  std::uint64_t chunk_bytes_ = 0;
  std::size_t row_numbers_ = 1;
  bool direct_ = false;  // chunks are read without the library's filters
  std::vector<ChunkFilter> filters_;

  std::vector<std::uint8_t> rows_;  // bytes of the block
  std::vector<std::uint8_t> chunk_;
  std::vector<std::uint8_t> scratch_;
};

}  // namespace efm
