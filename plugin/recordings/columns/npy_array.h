// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "mapping/base/npy_header.h"
#include "plugin/recordings/columns/event_table.h"
#include "plugin/recordings/files/file_content.h"

namespace efm {

/// Reads the header of an array in a file of its own, or in a member of a .npz file.
NpyHeader readNpyHeader(const std::filesystem::path& file, const std::string& member = {});

/// The numbers of a NumPy array in a file of its own (.npy) or in a member of an archive (.npz). A
/// member is read from front to back. Memory holds one block.
class NpyArray : public NumberRows {
 public:
  /// @param member name in a .npz file, with ".npy"; empty: the file is the array.
  /// @throws std::runtime_error for arrays that are not stored row after row.
  explicit NpyArray(const std::filesystem::path& file, const std::string& member = {});

  const NpyHeader& header() const { return header_; }
  /// Numbers per row: the product of all sizes but the first, or the number of fields.
  std::size_t columns() const { return columns_.size(); }
  /// Returns a column of an array. An empty array has no columns: the result is then not used.
  static RowColumn columnOf(std::shared_ptr<NpyArray> array, std::size_t column);

  bool canSeek() const override { return content_.seekableBytes() > 0; }
  std::string placeOf(std::uint64_t row) const override;
  /// The name for errors: "poses.npz/t.npy".
  const std::string& name() const { return name_; }

 private:
  RowBlock readBlock(std::uint64_t row) override;
  void setColumns();

  FileContent content_;
  std::string name_;
  NpyHeader header_;
  std::vector<NpyField> columns_;
  std::uint64_t begin_ = 0;  // byte of the first row
  std::uint64_t next_ = 0;   // the row after the last block
  std::string ahead_;        // bytes read after the header
  std::vector<char> bytes_;  // of the block
};

}  // namespace efm
