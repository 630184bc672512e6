// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/columns/hdf5_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace efm {
namespace {

constexpr std::uint64_t kMaxRowBytes = 65'536;

/// The product of the sides from `first` on; nothing above `max`.
std::optional<std::uint64_t> productOf(const std::vector<hsize_t>& sides, std::size_t first,
                                       std::uint64_t max) {
  std::uint64_t product = 1;
  for (std::size_t i = first; i < sides.size(); ++i) {
    if (sides[i] > 0 && product > max / sides[i]) return std::nullopt;
    product *= sides[i];
  }
  return product;
}

/// Moves an index to the next one of a grid whose last dimension runs fastest.
/// @return false after the last one.
bool advance(std::vector<hsize_t>& index, std::size_t first, const std::vector<hsize_t>& ends,
             const std::vector<hsize_t>& steps) {
  for (std::size_t i = index.size(); i-- > first;) {
    index[i] += steps[i];
    if (index[i] < ends[i]) return true;
    index[i] = 0;
  }
  return false;
}

}  // namespace

Hdf5Rows::Hdf5Rows(std::shared_ptr<const Hdf5File> file, std::string path)
    : file_(std::move(file)), path_(std::move(path)), set_(file_->dataset(path_)) {
  const Hdf5Quiet quiet;
  type_ = Hdf5Id(H5Dget_type(set_.get()), H5Tclose);
  element_bytes_ = H5Tget_size(type_.get());
  const Hdf5Id space(H5Dget_space(set_.get()), H5Sclose);
  const int rank = H5Sget_simple_extent_ndims(space.get());
  if (rank < 1 || element_bytes_ == 0) throw fail("expected a list of numbers");
  sides_.resize(static_cast<std::size_t>(rank));
  H5Sget_simple_extent_dims(space.get(), sides_.data(), nullptr);
  size_ = sides_[0];
  const auto numbers = productOf(sides_, 1, kMaxRowBytes / element_bytes_);
  if (!numbers) throw fail(fmt::format("expected rows of at most {} bytes", kMaxRowBytes));
  row_numbers_ = static_cast<std::size_t>(*numbers);
  if (rowBytes() == 0) size_ = 0;
  if (size_ > 0) readLayout();
}

void Hdf5Rows::readLayout() {
  const Hdf5Id creation(H5Dget_create_plist(set_.get()), H5Pclose);
  const H5D_layout_t layout = H5Pget_layout(creation.get());
  chunk_sides_ = sides_;
  if (layout == H5D_CHUNKED) {
    H5Pget_chunk(creation.get(), static_cast<int>(sides_.size()), chunk_sides_.data());
    readFilters(creation.get());
  } else if (layout == H5D_CONTIGUOUS || layout == H5D_COMPACT) {
    const std::uint64_t stored = H5Dget_storage_size(set_.get());
    if (stored > file_->bytes() || stored / rowBytes() < size_) {
      throw fail(fmt::format("{} bytes are stored for {} rows: expected all rows in the file",
                             stored, size_));
    }
    constexpr std::uint64_t kBlockBytes = std::uint64_t{1} << 19;
    chunk_sides_[0] = std::clamp<std::uint64_t>(kBlockBytes / rowBytes(), 1, size_);
  } else {
    throw fail("expected a data set that is stored in this file");
  }
  const auto numbers = productOf(chunk_sides_, 0, kMaxChunkBytes / element_bytes_);
  if (!numbers || *numbers == 0 || !productOf({chunk_sides_[0], rowBytes()}, 0, kMaxChunkBytes) ||
      !productOf(chunk_sides_, 1, kMaxRowBytes)) {
    throw fail(fmt::format("expected chunks of at most {} bytes", kMaxChunkBytes));
  }
  chunk_bytes_ = *numbers * element_bytes_;
}

void Hdf5Rows::readFilters(hid_t creation) {
  direct_ = true;
  const int count = H5Pget_nfilters(creation);
  for (int i = 0; i < count; ++i) {
    unsigned flags = 0;
    std::size_t values = 0;
    const ChunkFilter filter = H5Pget_filter2(creation, static_cast<unsigned>(i), &flags, &values,
                                              nullptr, 0, nullptr, nullptr);
    filters_.push_back(filter);
    if (isKnownFilter(filter)) continue;
    direct_ = false;
    if (H5Zfilter_avail(filter) <= 0) {
      throw fail("it is compressed with " + adviceForFilter(filter));
    }
  }
}

const RowBlock& Hdf5Rows::blockAt(std::uint64_t row) {
  if (row >= block_.first && row < block_.end) return block_;
  const Hdf5Quiet quiet;
  block_ = {};
  const std::uint64_t first = row - row % chunk_sides_[0];
  const std::uint64_t rows = std::min<std::uint64_t>(chunk_sides_[0], size_ - first);
  if (direct_) {
    readChunks(first);
  } else {
    readSelection(first, rows);
  }
  block_ = {rows_.data(), first, first + rows};
  return block_;
}

/// The chunks of a range of rows: one, or several beside each other.
void Hdf5Rows::readChunks(std::uint64_t first_row) {
  std::vector<hsize_t> offset(sides_.size(), 0);
  offset[0] = first_row;
  do {
    readChunk(offset);
    if (chunk_bytes_ == chunk_sides_[0] * rowBytes()) {
      rows_.swap(chunk_);
    } else {
      placeChunk(offset);
    }
  } while (advance(offset, 1, sides_, chunk_sides_));
}

void Hdf5Rows::readChunk(const std::vector<hsize_t>& offset) {
  hsize_t stored = 0;
  if (H5Dget_chunk_storage_size(set_.get(), offset.data(), &stored) < 0 || stored == 0) {
    throw failAt(offset[0], "the chunk is missing: expected a complete file");
  }
  // A filter may enlarge what it cannot compress by some bytes.
  const std::uint64_t max = std::min(file_->bytes(), 2 * chunk_bytes_ + 1024);
  if (stored > max) {
    throw failAt(offset[0], fmt::format("a chunk of {} bytes: expected at most {}", stored, max));
  }
  chunk_.resize(static_cast<std::size_t>(stored));
  std::uint32_t skipped = 0;
  if (H5Dread_chunk(set_.get(), H5P_DEFAULT, offset.data(), &skipped, chunk_.data()) < 0) {
    throw failAt(offset[0], "the chunk cannot be read" + hdf5Cause());
  }
  const auto bytes = static_cast<std::size_t>(chunk_bytes_);
  if (const auto filter = undoFilters(filters_, skipped, element_bytes_, bytes, chunk_, scratch_)) {
    throw failAt(offset[0], fmt::format("the chunk is damaged: filter {} does not give the {} "
                                        "bytes that are expected",
                                        *filter, bytes));
  }
  if (chunk_.size() != bytes) {
    throw failAt(offset[0], fmt::format("the chunk is damaged: it has {} bytes, {} are expected",
                                        chunk_.size(), bytes));
  }
}

/// Copies the numbers of a chunk that holds a part of each row to their positions.
void Hdf5Rows::placeChunk(const std::vector<hsize_t>& offset) {
  rows_.resize(static_cast<std::size_t>(chunk_sides_[0]) * rowBytes());
  std::vector<std::ptrdiff_t> positions;  // in the row, of each number in the chunk's rows; or -1
  std::vector<hsize_t> index(sides_.size(), 0);
  const std::vector<hsize_t> ones(sides_.size(), 1);
  do {
    std::uint64_t position = 0;
    bool inside = true;
    for (std::size_t i = 1; i < sides_.size(); ++i) {
      inside = inside && offset[i] + index[i] < sides_[i];
      position = position * sides_[i] + offset[i] + index[i];
    }
    positions.push_back(inside ? static_cast<std::ptrdiff_t>(position * element_bytes_) : -1);
  } while (advance(index, 1, chunk_sides_, ones));
  const std::uint8_t* from = chunk_.data();
  std::uint8_t* row = rows_.data();
  for (std::uint64_t i = 0; i < chunk_sides_[0]; ++i, row += rowBytes()) {
    for (const std::ptrdiff_t position : positions) {
      if (position >= 0) std::copy_n(from, element_bytes_, row + position);
      from += element_bytes_;
    }
  }
}

void Hdf5Rows::readSelection(std::uint64_t first_row, std::uint64_t rows) {
  std::vector<hsize_t> start(sides_.size(), 0);
  std::vector<hsize_t> count = sides_;
  start[0] = first_row;
  count[0] = rows;
  rows_.resize(static_cast<std::size_t>(rows) * rowBytes());
  const auto rank = static_cast<int>(sides_.size());
  const Hdf5Id memory(H5Screate_simple(rank, count.data(), nullptr), H5Sclose);
  const Hdf5Id space(H5Dget_space(set_.get()), H5Sclose);
  if (H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, start.data(), nullptr, count.data(),
                          nullptr) < 0 ||
      H5Dread(set_.get(), type(), memory.get(), space.get(), H5P_DEFAULT, rows_.data()) < 0) {
    throw failAt(first_row, "cannot be read" + hdf5Cause());
  }
}

std::runtime_error Hdf5Rows::failAt(std::uint64_t row, std::string_view what) const {
  return file_->fail(fmt::format("{}[{}]", path_, row), what);
}

}  // namespace efm
