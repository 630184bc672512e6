// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/columns/npy_array.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

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

}  // namespace

NpyHeader readNpyHeader(const std::filesystem::path& file, const std::string& member) {
  return parseHeader(firstContentOf(file, kHeaderBytes, member), nameOf(file, member));
}

NpyArray::NpyArray(const std::filesystem::path& file, const std::string& member)
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
  setColumns();
}

void NpyArray::setColumns() {
  begin_ = header_.data_begin;
  row_bytes_ = header_.element_bytes;
  if (header_.structured) {
    size_ = header_.count();
    columns_ = header_.fields;
    return;
  }
  try {
    requirePlainRows(header_);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{}: {}", name_, error.what()));
  }
  size_ = header_.shape.empty() ? 1 : header_.shape[0];
  constexpr std::uint64_t kMaxColumns = 1024;
  const std::uint64_t columns = size_ == 0 ? 0 : header_.count() / size_;
  if (columns > kMaxColumns) {
    throw std::runtime_error(
        fmt::format("{}: {} numbers a row: expected at most {}", name_, columns, kMaxColumns));
  }
  columns_.assign(static_cast<std::size_t>(columns), {"", header_.type, header_.big_endian, 0});
  for (std::size_t k = 0; k < columns_.size(); ++k) columns_[k].offset = k * header_.element_bytes;
  row_bytes_ = columns_.size() * header_.element_bytes;
}

/// Reads few rows after a jump, which may be a step of a bisection.
RowBlock NpyArray::readBlock(std::uint64_t row) {
  constexpr std::size_t kMaxRows = std::size_t{1} << 16;
  constexpr std::size_t kMaxBytes = std::size_t{1} << 23;
  constexpr std::size_t kJumpBytes = 4096;
  const bool jump = row != next_;
  if (jump) {
    content_.seek(begin_ + row * row_bytes_);
    ahead_.clear();
    next_ = row;
  }
  const std::size_t fitting =
      (jump ? kJumpBytes : kMaxBytes) / std::max<std::size_t>(1, row_bytes_);
  const auto count = static_cast<std::size_t>(
      std::min<std::uint64_t>(std::clamp<std::size_t>(fitting, 1, kMaxRows), size_ - row));
  bytes_.resize(count * row_bytes_);
  const std::size_t from_ahead = std::min(ahead_.size(), bytes_.size());
  std::copy_n(ahead_.begin(), from_ahead, bytes_.begin());
  ahead_.erase(0, from_ahead);
  const std::size_t rest = bytes_.size() - from_ahead;
  const std::size_t got = content_.read(bytes_.data() + from_ahead, rest);
  if (got < rest) {
    throw failAt(row + (from_ahead + got) / row_bytes_,
                 fmt::format("the file ends: expected {} rows", size_));
  }
  next_ = row + count;
  return {bytes_.data(), row, next_};
}

RowColumn NpyArray::columnOf(std::shared_ptr<NpyArray> array, std::size_t column) {
  const NpyField field = column < array->columns() ? array->columns_[column] : NpyField{};
  return {std::move(array), field.offset, field.type, field.big_endian};
}

std::string NpyArray::placeOf(std::uint64_t row) const {
  return fmt::format("{}: row {}", name_, row);
}

}  // namespace efm
