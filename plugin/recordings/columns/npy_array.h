// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "maps/io/npy_header.h"
#include "plugin/recordings/streams/file_content.h"

namespace efm {

/// What precedes the numbers of an array in a file of its own, or in a member of a .npz file.
NpyHeader readNpyHeader(const std::filesystem::path& file, const std::string& member = {});

/// Which numbers of an array are read.
struct NpyPart {
  /// The fields of a structured array are its columns, as `NpyHeader::fields` has them.
  bool fields = false;
  /// Of a matrix whose columns stand one after the other, this one: of N x 4 in Fortran order, or
  /// of 4 x N in C order.
  std::optional<std::size_t> line;
  /// A matrix in Fortran order is read as its transpose, whose rows stand one after the other.
  bool transposed = false;
};

/// The numbers of a NumPy array in a file of its own (.npy) or a member of an archive (.npz), from
/// front to back. Memory is that of a block.
class NpyArray {
 public:
  /// @param member of a .npz file, with its ".npy"; empty: the file is the array.
  /// @param part without it, an array of numbers in C order is expected.
  explicit NpyArray(const std::filesystem::path& file, const std::string& member = {},
                    const NpyPart& part = {});

  const NpyHeader& header() const { return header_; }
  /// Numbers per row: the product of all sizes but the first one, or the number of fields.
  std::size_t columns() const { return columns_.size(); }
  std::uint64_t rows() const { return rows_; }
  std::size_t rowBytes() const { return row_bytes_; }
  /// Whether the numbers of a column are float or double.
  bool isReal(std::size_t column = 0) const;

  /// Replaces the block by the next rows; fewer than `max_rows` only at the end.
  /// @return the number of rows.
  std::size_t readRows(std::size_t max_rows);
  /// The first rows, which the next `readRows` reads again. Called before `readRows`.
  /// @return the number of rows that are there, at most `max_rows`.
  std::size_t sampleRows(std::size_t max_rows);
  /// Continues at a row, of a file that is not compressed.
  void seek(std::uint64_t row);
  bool canSeek() const { return content_.seekableBytes() > 0; }
  /// The number of the next row.
  std::uint64_t position() const { return position_; }

  /// A number of the block.
  double number(std::size_t row, std::size_t column = 0) const;
  /// The same as a whole number; nothing where it is none, or beyond 64 bits.
  std::optional<std::int64_t> whole(std::size_t row, std::size_t column = 0) const;
  /// The same as a time in nanoseconds; nothing where it is none, or beyond kEndOfTimeNs. Real
  /// numbers are rounded to what they resolve (`nanoseconds`).
  /// @param exponent of the unit: 10^exponent seconds.
  std::optional<std::int64_t> time(std::size_t row, std::size_t column, int exponent) const;

  /// "poses.npz/t.npy".
  const std::string& name() const { return name_; }
  std::runtime_error failure(std::uint64_t row, const std::string& what) const;

 private:
  void setColumns(const NpyPart& part);
  void skip(std::uint64_t bytes);
  const char* at(std::size_t row, std::size_t column) const;

  FileContent content_;
  std::string name_;
  NpyHeader header_;
  std::uint64_t rows_ = 1;
  std::vector<NpyField> columns_;
  std::size_t row_bytes_ = 0;
  std::uint64_t begin_ = 0;  // byte of the first row
  std::uint64_t position_ = 0;
  std::string ahead_;  // bytes read behind the header
  std::vector<char> block_;
};

}  // namespace efm
