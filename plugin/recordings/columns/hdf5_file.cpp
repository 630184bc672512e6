// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/columns/hdf5_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <system_error>

#include "mapping/base/atomic_file.h"
#include "plugin/recordings/columns/hdf5_crash_note.h"

namespace efm {
namespace {

/// The maximum length of a text: names of models and sizes are short.
constexpr std::size_t kMaxTextBytes = 4096;

herr_t keepCause(unsigned position, const H5E_error2_t* error, void* cause) {
  if (position == 0 && error->desc != nullptr) *static_cast<std::string*>(cause) = error->desc;
  return 0;
}

/// Returns the text that `read` gives for a type in memory; std::nullopt if it is no single text.
template <typename Read>
std::optional<std::string> readText(hid_t type, hid_t space, const Read& read) {
  if (H5Tget_class(type) != H5T_STRING || H5Sget_simple_extent_npoints(space) != 1) {
    return std::nullopt;
  }
  if (H5Tis_variable_str(type) > 0) {
    char* text = nullptr;
    if (read(type, &text) < 0 || text == nullptr) return std::nullopt;
    std::string copy(text, strnlen(text, kMaxTextBytes));
    H5free_memory(text);
    return copy;
  }
  const std::size_t bytes = H5Tget_size(type);
  if (bytes > kMaxTextBytes) return std::nullopt;
  std::string text(bytes, '\0');
  if (read(type, text.data()) < 0) return std::nullopt;
  text.resize(std::min(text.size(), text.find_last_not_of(std::string_view("\0 ", 2)) + 1));
  return text;
}

}  // namespace

std::string hdf5Cause() {
  std::string cause;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keepCause, &cause);
  constexpr std::string_view kErrno = "errno = ";
  const std::size_t number = cause.find(kErrno);
  if (number != std::string::npos) {
    const std::string why = reasonNotWritten(std::atoi(cause.c_str() + number + kErrno.size()));
    if (!why.empty()) return " (" + why + ")";
  }
  return cause.empty() ? cause : " (" + cause + ")";
}

Hdf5File::Hdf5File(std::filesystem::path file) : path_(std::move(file)) {
  const Hdf5Quiet quiet;
  std::error_code error;
  bytes_ = std::filesystem::file_size(path_, error);
  if (error) throw std::runtime_error(path_.string() + ": cannot be opened for reading");
  const Hdf5Id access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  // Network file systems may have no locks, and a file that is only read needs no lock.
  H5Pset_file_locking(access.get(), false, true);
  id_ = Hdf5Id(H5Fopen(path_.c_str(), H5F_ACC_RDONLY, access.get()), H5Fclose);
  if (!id_.valid()) {
    throw std::runtime_error(
        fmt::format("{}: cannot be opened as HDF5{}: expected a complete HDF5 file", path_.string(),
                    hdf5Cause()));
  }
}

bool Hdf5File::has(const std::string& path) const {
  const Hdf5Quiet quiet;
  return H5Oexists_by_name(id(), path.c_str(), H5P_DEFAULT) > 0;
}

Hdf5Id Hdf5File::dataset(const std::string& path) const {
  const Hdf5Quiet quiet;
  Hdf5Id dataset(H5Dopen2(id(), path.c_str(), H5P_DEFAULT), H5Dclose);
  if (!dataset.valid()) {
    throw fail(path, "cannot be opened" + hdf5Cause() + ": expected a data set");
  }
  return dataset;
}

std::vector<double> Hdf5File::numbers(const std::string& path, std::size_t count,
                                      std::string_view expected) const {
  std::vector<double> values(count);
  if (!readAll(path, H5T_NATIVE_DOUBLE, count, values.data())) {
    throw fail(path, fmt::format("expected {} numbers, {}", count, expected));
  }
  for (const double value : values) {
    if (!std::isfinite(value)) throw fail(path, fmt::format("{}: expected {}", value, expected));
  }
  return values;
}

std::int64_t Hdf5File::integer(const std::string& path) const {
  std::int64_t value = 0;
  if (!readAll(path, H5T_NATIVE_INT64, 1, &value)) throw fail(path, "expected a whole number");
  return value;
}

/// Reads a data set of `count` numbers. If `type` is an integer type, they must be integers.
/// @return whether it could be read.
bool Hdf5File::readAll(const std::string& path, hid_t type, std::size_t count, void* to) const {
  const Hdf5Quiet quiet;
  const Hdf5Id set = dataset(path);
  const Hdf5Id space(H5Dget_space(set.get()), H5Sclose);
  const Hdf5Id stored(H5Dget_type(set.get()), H5Tclose);
  return (H5Tget_class(type) != H5T_INTEGER || H5Tget_class(stored.get()) == H5T_INTEGER) &&
         H5Sget_simple_extent_npoints(space.get()) == static_cast<hssize_t>(count) &&
         H5Dread(set.get(), type, H5S_ALL, H5S_ALL, H5P_DEFAULT, to) >= 0;
}

std::string Hdf5File::text(const std::string& path) const {
  const Hdf5Quiet quiet;
  const Hdf5Id set = dataset(path);
  const Hdf5Id type(H5Dget_type(set.get()), H5Tclose);
  const Hdf5Id space(H5Dget_space(set.get()), H5Sclose);
  std::optional<std::string> text =
      readText(type.get(), space.get(), [&](hid_t memory, void* value) {
        return H5Dread(set.get(), memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, value);
      });
  if (!text) throw fail(path, "expected a text");
  return *std::move(text);
}

std::optional<std::string> Hdf5File::attribute(const char* name) const {
  const Hdf5Quiet quiet;
  if (H5Aexists(id(), name) <= 0) return std::nullopt;
  const Hdf5Id attribute(H5Aopen(id(), name, H5P_DEFAULT), H5Aclose);
  const Hdf5Id type(H5Aget_type(attribute.get()), H5Tclose);
  const Hdf5Id space(H5Aget_space(attribute.get()), H5Sclose);
  return readText(type.get(), space.get(), [&](hid_t memory, void* value) {
    return H5Aread(attribute.get(), memory, value);
  });
}

std::runtime_error Hdf5File::fail(const std::string& path, std::string_view what) const {
  return std::runtime_error(fmt::format("{}:{}: {}", path_.string(), path, what));
}

namespace {

constexpr std::uint64_t kMaxRowBytes = 65'536;

/// Returns the product of the sides from index `first` on; std::nullopt if it is above `max`.
std::optional<std::uint64_t> productOf(const std::vector<hsize_t>& sides, std::size_t first,
                                       std::uint64_t max) {
  std::uint64_t product = 1;
  for (std::size_t i = first; i < sides.size(); ++i) {
    if (sides[i] > 0 && product > max / sides[i]) return std::nullopt;
    product *= sides[i];
  }
  return product;
}

/// Advances an index within a row of a grid. The last dimension changes fastest.
/// @return false after the last index of the row.
bool advance(std::vector<hsize_t>& index, const std::vector<hsize_t>& ends,
             const std::vector<hsize_t>& steps) {
  for (std::size_t i = index.size(); i-- > 1;) {
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
  row_bytes_ = row_numbers_ * element_bytes_;
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

RowBlock Hdf5Rows::readBlock(std::uint64_t row) {
  const Hdf5CrashNote note(file_->path());
  const Hdf5Quiet quiet;
  const std::uint64_t first = row - row % chunk_sides_[0];
  const std::uint64_t rows = std::min<std::uint64_t>(chunk_sides_[0], size_ - first);
  if (direct_) {
    readChunks(first);
  } else {
    readSelection(first, rows);
  }
  return {reinterpret_cast<const char*>(rows_.data()), first, first + rows};
}

/// Reads the chunks of a range of rows: one chunk, or several side by side.
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
  } while (advance(offset, sides_, chunk_sides_));
}

void Hdf5Rows::readChunk(const std::vector<hsize_t>& offset) {
  hsize_t stored = 0;
  if (H5Dget_chunk_storage_size(set_.get(), offset.data(), &stored) < 0 || stored == 0) {
    throw failAt(offset[0], "the chunk is missing: expected a complete file");
  }
  // A filter may add some bytes to data that it cannot compress.
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

/// Copies the numbers of a chunk, which holds a part of each row, to their positions.
void Hdf5Rows::placeChunk(const std::vector<hsize_t>& offset) {
  rows_.resize(static_cast<std::size_t>(chunk_sides_[0]) * rowBytes());
  std::vector<std::ptrdiff_t> positions;  // byte in the set's row of each number; -1: outside
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
  } while (advance(index, chunk_sides_, ones));
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
      H5Dread(set_.get(), type_.get(), memory.get(), space.get(), H5P_DEFAULT, rows_.data()) < 0) {
    throw failAt(first_row, "cannot be read" + hdf5Cause());
  }
}

std::string Hdf5Rows::placeOf(std::uint64_t row) const {
  return fmt::format("{}:{}[{}]", file_->path().string(), path_, row);
}

NumberType Hdf5Rows::numberType(hid_t type) const {
  const H5T_class_t kind = H5Tget_class(type);
  const std::size_t bytes = H5Tget_size(type);
  if (kind == H5T_ENUM) {  // h5py's bool
    const Hdf5Id super(H5Tget_super(type), H5Tclose);
    if (H5Tget_size(super.get()) == bytes) return numberType(super.get());
  }
  const bool little = bytes == 1 || H5Tget_order(type) == H5T_ORDER_LE;
  const char letter = kind == H5T_FLOAT                ? 'f'
                      : kind != H5T_INTEGER            ? ' '
                      : H5Tget_sign(type) == H5T_SGN_2 ? 'i'
                                                       : 'u';
  const std::optional<NumberType> found = numberTypeOf(letter, bytes);
  if (little && found) return *found;
  throw fail("expected whole numbers of 1, 2, 4 or 8 bytes, float or double, little-endian");
}

RowColumn Hdf5Rows::ofMatrix(std::shared_ptr<Hdf5Rows> rows, std::size_t index) {
  if (index >= rows->rowNumbers()) {
    throw rows->fail(fmt::format("{} columns: expected {} or more", rows->rowNumbers(), index + 1));
  }
  const NumberType type = rows->numberType(rows->type_.get());
  const std::size_t offset = index * (rows->rowBytes() / rows->rowNumbers());
  return {std::move(rows), offset, type};
}

RowColumn Hdf5Rows::ofField(std::shared_ptr<Hdf5Rows> rows, const std::string& field) {
  const Hdf5Quiet quiet;
  const hid_t compound = rows->type_.get();
  const bool is_compound = H5Tget_class(compound) == H5T_COMPOUND && rows->rowNumbers() == 1;
  const int index = is_compound ? H5Tget_member_index(compound, field.c_str()) : -1;
  if (index < 0) throw rows->fail("expected a list of compound values with a field " + field);
  const auto member = static_cast<unsigned>(index);
  const Hdf5Id member_type(H5Tget_member_type(compound, member), H5Tclose);
  const NumberType type = rows->numberType(member_type.get());
  const std::size_t offset = H5Tget_member_offset(compound, member);
  // The library does not check this.
  const std::size_t bytes = rows->rowBytes();
  if (offset > bytes || H5Tget_size(member_type.get()) > bytes - offset) {
    throw rows->fail(fmt::format("field {} at byte {}: expected a field inside a row of {} bytes",
                                 field, offset, bytes));
  }
  return {std::move(rows), offset, type};
}

}  // namespace efm
