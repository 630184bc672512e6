// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "maps/io/npy_header.h"
#include "plugin/recordings/columns/event_table.h"
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

/// The numbers of a NumPy array in a file of its own (.npy) or a member of an archive (.npz), which
/// is read from front to back. Memory is that of a block.
class NpyArray : public NumberRows {
 public:
  /// @param member of a .npz file, with its ".npy"; empty: the file is the array.
  /// @param part without it, an array of numbers in C order is expected.
  explicit NpyArray(const std::filesystem::path& file, const std::string& member = {},
                    const NpyPart& part = {});

  const NpyHeader& header() const { return header_; }
  /// Numbers per row: the product of all sizes but the first one, or the number of fields.
  std::size_t columns() const { return columns_.size(); }
  /// A column of an array; without such a column, which an empty array has not, any.
  static RowColumn columnOf(std::shared_ptr<NpyArray> array, std::size_t column);

  bool canSeek() const override { return content_.seekableBytes() > 0; }
  std::string placeOf(std::uint64_t row) const override;
  /// "poses.npz/t.npy".
  const std::string& name() const { return name_; }

 private:
  RowBlock readBlock(std::uint64_t row) override;
  void setColumns(const NpyPart& part);
  void skip(std::uint64_t bytes);

  FileContent content_;
  std::string name_;
  NpyHeader header_;
  std::vector<NpyField> columns_;
  std::uint64_t begin_ = 0;  // byte of the first row
  std::uint64_t next_ = 0;   // the row behind the last block
  std::string ahead_;        // bytes read behind the header
  std::vector<char> bytes_;  // of the block
};

}  // namespace efm
