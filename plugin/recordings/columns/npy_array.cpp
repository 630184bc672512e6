// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/columns/npy_array.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "plugin/recordings/streams/time_unit.h"

namespace efm {
namespace {

constexpr std::size_t kHeaderBytes = 65'536;

std::string nameOf(const std::filesystem::path& file, const std::string& member) {
  return file.string() + (member.empty() ? "" : "/" + member);
}

NpyHeader parseHeader(const std::string& bytes, const std::string& name) {
  try {
    return parseNpyHeader(bytes);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{}: {}", name, error.what()));
  }
}

template <typename Number>
Number wholeAt(const char* bytes, bool big_endian) {
  std::array<char, sizeof(Number)> ordered;
  std::memcpy(ordered.data(), bytes, ordered.size());
  if (big_endian) std::reverse(ordered.begin(), ordered.end());
  Number number;
  std::memcpy(&number, ordered.data(), sizeof number);
  return number;
}

}  // namespace

NpyHeader readNpyHeader(const std::filesystem::path& file, const std::string& member) {
  FileContent content(file, member);
  std::string bytes(kHeaderBytes, '\0');
  bytes.resize(content.read(bytes.data(), kHeaderBytes));
  return parseHeader(bytes, nameOf(file, member));
}

NpyArray::NpyArray(const std::filesystem::path& file, const std::string& member,
                   const NpyPart& part)
    : content_(file, member), name_(nameOf(file, member)) {
  ahead_.resize(kHeaderBytes);
  ahead_.resize(content_.read(ahead_.data(), kHeaderBytes));
  header_ = parseHeader(ahead_, name_);
  ahead_.erase(0, header_.data_begin);
  const std::uint64_t file_bytes = content_.seekableBytes();
  if (file_bytes > 0 && file_bytes - header_.data_begin < header_.bytes()) {
    throw std::runtime_error(
        fmt::format("{}: {} bytes follow the array's header: expected {} for {} numbers", name_,
                    file_bytes - header_.data_begin, header_.bytes(), header_.count()));
  }
  setColumns(part);
}

void NpyArray::setColumns(const NpyPart& part) {
  begin_ = header_.data_begin;
  row_bytes_ = header_.element_bytes;
  const std::vector<std::uint64_t>& shape = header_.shape;
  const NpyField number = {"", header_.type, header_.big_endian, 0};
  if (part.fields && header_.structured) {
    rows_ = header_.count();
    columns_ = header_.fields;
    return;
  }
  if (part.line && !header_.structured && shape.size() == 2) {
    rows_ = header_.fortran_order ? shape[0] : shape[1];
    columns_ = {number};
    begin_ += *part.line * rows_ * row_bytes_;
    if (*part.line > 0) skip(begin_ - header_.data_begin);
    return;
  }
  const bool transposed = part.transposed && header_.fortran_order && shape.size() == 2;
  if (!transposed) {
    try {
      requirePlainRows(header_);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("{}: {}", name_, error.what()));
    }
  }
  if (!shape.empty()) rows_ = transposed ? shape[1] : shape[0];
  constexpr std::uint64_t kMaxColumns = 1024;
  const std::uint64_t columns = rows_ == 0 ? 0 : header_.count() / rows_;
  if (columns > kMaxColumns) {
    throw std::runtime_error(
        fmt::format("{}: {} numbers a row: expected at most {}", name_, columns, kMaxColumns));
  }
  columns_.assign(static_cast<std::size_t>(columns), number);
  for (std::size_t k = 0; k < columns_.size(); ++k) columns_[k].offset = k * header_.element_bytes;
  row_bytes_ = columns_.size() * header_.element_bytes;
}

/// Skips bytes of the array.
void NpyArray::skip(std::uint64_t bytes) {
  if (content_.seekableBytes() > 0) {
    content_.seek(header_.data_begin + bytes);
    ahead_.clear();
    return;
  }
  const auto from_ahead = static_cast<std::size_t>(std::min<std::uint64_t>(bytes, ahead_.size()));
  ahead_.erase(0, from_ahead);
  bytes -= from_ahead;
  std::string skipped(kHeaderBytes, '\0');
  while (bytes > 0) {
    const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(bytes, skipped.size()));
    const std::size_t got = content_.read(skipped.data(), count);
    bytes -= got;
    if (got < count) throw failure(0, fmt::format("the file ends: expected {} rows", rows_));
  }
}

bool NpyArray::isReal(std::size_t column) const {
  if (column >= columns_.size()) return false;
  const NumberType type = columns_[column].type;
  return type == NumberType::kFloat32 || type == NumberType::kFloat64;
}

std::size_t NpyArray::readRows(std::size_t max_rows) {
  const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(max_rows, rows_ - position_));
  block_.resize(count * row_bytes_);
  const std::size_t from_ahead = std::min(ahead_.size(), block_.size());
  std::copy_n(ahead_.begin(), from_ahead, block_.begin());
  ahead_.erase(0, from_ahead);
  const std::size_t rest = block_.size() - from_ahead;
  const std::size_t got = content_.read(block_.data() + from_ahead, rest);
  if (got < rest) {
    const std::uint64_t row = position_ + (from_ahead + got) / row_bytes_;
    block_.resize(0);
    throw failure(row, fmt::format("the file ends: expected {} rows", rows_));
  }
  position_ += count;
  return count;
}

std::size_t NpyArray::sampleRows(std::size_t max_rows) {
  if (row_bytes_ == 0) return 0;
  const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(max_rows, rows_));
  const std::size_t bytes = wanted * row_bytes_;
  if (const std::size_t before = ahead_.size(); before < bytes) {
    ahead_.resize(bytes);
    ahead_.resize(before + content_.read(ahead_.data() + before, bytes - before));
  }
  const std::size_t count = std::min(wanted, ahead_.size() / row_bytes_);
  block_.assign(ahead_.begin(), ahead_.begin() + static_cast<std::ptrdiff_t>(count * row_bytes_));
  return count;
}

void NpyArray::seek(std::uint64_t row) {
  content_.seek(begin_ + row * row_bytes_);
  ahead_.clear();
  position_ = row;
}

const char* NpyArray::at(std::size_t row, std::size_t column) const {
  return block_.data() + row * row_bytes_ + columns_[column].offset;
}

double NpyArray::number(std::size_t row, std::size_t column) const {
  return numberAt(at(row, column), columns_[column].type, columns_[column].big_endian);
}

std::optional<std::int64_t> NpyArray::whole(std::size_t row, std::size_t column) const {
  // A double does not hold all 64-bit numbers.
  const NpyField& field = columns_[column];
  if (field.type == NumberType::kInt64) {
    return wholeAt<std::int64_t>(at(row, column), field.big_endian);
  }
  if (field.type == NumberType::kUint64) {
    constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
    return wholeNumber(wholeAt<std::uint64_t>(at(row, column), field.big_endian), 0, kMax);
  }
  constexpr std::int64_t kMaxExact = std::int64_t{1} << 53;
  return wholeNumber(number(row, column), -kMaxExact, kMaxExact);
}

std::optional<std::int64_t> NpyArray::time(std::size_t row, std::size_t column,
                                           int exponent) const {
  const std::int64_t unit_ns = nanosecondsPer(exponent);
  if (columns_[column].type == NumberType::kFloat32) {
    return nanoseconds(static_cast<float>(number(row, column)), unit_ns);
  }
  if (isReal(column)) return nanoseconds(number(row, column), unit_ns);
  const std::optional<std::int64_t> value = whole(row, column);
  return value ? nanoseconds(*value, unit_ns) : std::nullopt;
}

std::runtime_error NpyArray::failure(std::uint64_t row, const std::string& what) const {
  return std::runtime_error(fmt::format("{}: row {}: {}", name_, row, what));
}

}  // namespace efm
