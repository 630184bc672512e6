// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "plugin/recordings/columns/chunk_filters.h"
#include "plugin/recordings/columns/hdf5_file.h"

namespace efm {

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
  /// @throws std::runtime_error naming the file, the data set and the row if it is damaged.
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

}  // namespace efm
