// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "mapping/base/number_bytes.h"
#include "plugin/recordings/streams/recording_parts.h"
#include "plugin/recordings/streams/time_unit.h"
#include "plugin/recordings/text/event_columns.h"

namespace efm {

/// Consecutive rows of a file in memory.
struct RowBlock {
  const char* data = nullptr;  ///< Bytes of row `first`, valid until the next rows are read.
  std::uint64_t first = 0;
  std::uint64_t end = 0;  ///< One past the last row.
};

/// Rows of numbers in a file, an HDF5 data set or a NumPy array. One block of rows is in memory.
class NumberRows {
 public:
  virtual ~NumberRows() = default;

  std::uint64_t size() const { return size_; }
  std::size_t rowBytes() const { return row_bytes_; }
  /// Returns the block that contains a row.
  /// @param row below `size`. If `canSeek` is false: in the last block, or the first row after it.
  const RowBlock& blockAt(std::uint64_t row) {
    if (row >= block_.first && row < block_.end) return block_;
    block_ = {};
    return block_ = readBlock(row);
  }
  /// Returns whether blocks may be read in any order.
  virtual bool canSeek() const { return true; }
  /// Returns the place of a row, for errors: "FILE: row 3".
  virtual std::string placeOf(std::uint64_t row) const = 0;
  std::runtime_error failAt(std::uint64_t row, const std::string& what) const {
    return std::runtime_error(placeOf(row) + ": " + what);
  }

 protected:
  std::uint64_t size_ = 0;
  std::size_t row_bytes_ = 0;

 private:
  virtual RowBlock readBlock(std::uint64_t row) = 0;

  RowBlock block_;
};

/// A column: one number of each row.
struct RowColumn {
  std::shared_ptr<NumberRows> rows;
  std::size_t offset = 0;  ///< Bytes from the beginning of a row.
  NumberType type = NumberType::kFloat64;
  bool big_endian = false;

  /// Returns the numbers from a row to the end of its block.
  Column from(std::uint64_t row) const {
    const RowBlock& block = rows->blockAt(row);
    return {block.data + (row - block.first) * rows->rowBytes() + offset, rows->rowBytes(), type,
            big_endian};
  }
  double number(std::uint64_t row) const { return from(row).number(0); }
  /// Returns a number as a time: see `nanoseconds`.
  std::optional<std::int64_t> time(std::uint64_t row, std::int64_t unit_ns) const;
};

/// The events of a camera in columns of numbers: polarity 1 is on; 0 and -1 are off.
struct EventTable {
  std::array<RowColumn, 4> columns;  ///< In the order of `kEventColumns`.
  std::string name;                  ///< Name of the file, or of the array of times.
  /// Errors name event i as PLACE[i]. If it is empty, they name the row of the wrong column.
  std::string place;
  std::string times;  ///< The name of the times, for the error of an unknown unit.
  std::optional<std::int64_t> time_unit_ns;  ///< Unit of t. Unset: found from values.
  std::int64_t offset_ns = 0;                ///< Added to t.
  std::optional<RowColumn> index;            ///< The first event of each millisecond of t.
  std::int64_t seek_margin_ns = 0;           ///< Additional time that `seek` goes back.
  bool inverted = false;                     ///< True if polarity 0 is on.
  std::optional<CameraSize> size;            ///< Size of the sensor, if it is known.
  std::vector<Warning> warnings;             ///< Warnings about the columns.

  RowColumn& column(char letter) { return columns[kEventColumns.find(letter)]; }
};

/// Opens a stream that reads block by block. `seek` uses the index and bisection, if rows can seek.
/// @param table columns with the same number of rows.
/// @param options unit of times, used if the table has none.
/// @throws std::runtime_error if the unit of time is not certain (`findTimeUnit`).
std::unique_ptr<EventStream> eventsOf(EventTable table, const ReaderOptions& options);

/// Returns the number of rows that are used to find the unit of times and the order of columns: at
/// most 5000, from the first block.
std::size_t sampledRows(const RowColumn& column);

}  // namespace efm
