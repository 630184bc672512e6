// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/numpy/npy_array.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "plugin/streams/number_checks.h"

namespace efm {
namespace {

template <typename Number>
Number littleEndianNumber(const char* bytes) {
  Number number;
  std::memcpy(&number, bytes, sizeof number);
  return number;
}

}  // namespace

NpyArray::NpyArray(const std::filesystem::path& file, const std::string& member)
    : content_(file, member), name_(file.string() + (member.empty() ? "" : "/" + member)) {
  constexpr std::size_t kHeaderBytes = 65'536;
  ahead_.resize(kHeaderBytes);
  ahead_.resize(content_.read(ahead_.data(), kHeaderBytes));
  try {
    header_ = parseNpyHeader(ahead_);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{}: {}", name_, error.what()));
  }
  ahead_.erase(0, header_.data_begin);
  if (!header_.shape.empty()) rows_ = header_.shape[0];
  const std::uint64_t file_bytes = content_.seekableBytes();
  if (file_bytes > 0 && file_bytes - header_.data_begin < header_.bytes()) {
    throw std::runtime_error(
        fmt::format("{}: {} bytes follow the array's header: expected {} for {} numbers", name_,
                    file_bytes - header_.data_begin, header_.bytes(), header_.count()));
  }
  constexpr std::uint64_t kMaxColumns = 1024;
  const std::uint64_t columns = rows_ == 0 ? 0 : header_.count() / rows_;
  if (columns > kMaxColumns) {
    throw std::runtime_error(
        fmt::format("{}: {} numbers a row: expected at most {}", name_, columns, kMaxColumns));
  }
  columns_ = static_cast<std::size_t>(columns);
  row_bytes_ = columns_ * sizeOf(header_.type);
}

bool NpyArray::isReal() const {
  return header_.type == NumberType::kFloat32 || header_.type == NumberType::kFloat64;
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

void NpyArray::seek(std::uint64_t row) {
  content_.seek(header_.data_begin + row * row_bytes_);
  ahead_.clear();
  position_ = row;
}

const char* NpyArray::at(std::size_t row, std::size_t column) const {
  return block_.data() + row * row_bytes_ + column * sizeOf(header_.type);
}

double NpyArray::number(std::size_t row, std::size_t column) const {
  return numberAt(at(row, column), header_.type, header_.big_endian);
}

std::optional<std::int64_t> NpyArray::whole(std::size_t row, std::size_t column) const {
  constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
  // A double does not hold all 64-bit numbers.
  if (!header_.big_endian && header_.type == NumberType::kInt64) {
    return littleEndianNumber<std::int64_t>(at(row, column));
  }
  if (!header_.big_endian && header_.type == NumberType::kUint64) {
    return wholeNumber(littleEndianNumber<std::uint64_t>(at(row, column)), 0, kMax);
  }
  constexpr std::int64_t kMaxExact = std::int64_t{1} << 53;
  return wholeNumber(number(row, column), -kMaxExact, kMaxExact);
}

std::optional<std::int64_t> NpyArray::time(std::size_t row, std::size_t column,
                                           int exponent) const {
  std::int64_t unit_ns = 1;
  for (int k = exponent; k > -9; --k) unit_ns *= 10;
  if (isReal()) {
    const double value = number(row, column);
    return unit_ns == 1 ? nanoseconds(value * 1e-3, 1'000) : nanoseconds(value, unit_ns);
  }
  const std::optional<std::int64_t> value = whole(row, column);
  return value ? nanoseconds(*value, unit_ns) : std::nullopt;
}

std::runtime_error NpyArray::failure(std::uint64_t row, const std::string& what) const {
  return std::runtime_error(fmt::format("{}: row {}: {}", name_, row, what));
}

}  // namespace efm
