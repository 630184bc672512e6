// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plugin/recordings/columns/npy_array.h"
#include "plugin/recordings/streams/event_stream.h"
#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// A number of each row of an array.
struct NpyColumn {
  std::shared_ptr<NpyArray> array;
  std::size_t index = 0;
};

/// Where the numbers of events are: columns of one array, or of several with as many rows.
struct NpyEventColumns {
  NpyColumn t;
  NpyColumn x;
  NpyColumn y;
  NpyColumn p;
  std::optional<int> time_exponent;  ///< If it is known: 10^exponent seconds. Else it is found.
  bool inverted = false;             ///< Polarity 0 is on.
  std::optional<CameraSize> size;    ///< Of the sensor, if it is known.
  std::vector<Warning> warnings;     ///< About the columns.
};

/// The events of a camera in NumPy arrays. Polarity is 0 or 1, or -1 or 1. Memory is that of a
/// block. Arrays that are not compressed are sought by bisection.
class ArrayEvents : public EventStream {
 public:
  /// @throws std::runtime_error naming the array of other length than t, or whose unit of time is
  /// not certain.
  ArrayEvents(NpyEventColumns columns, const ReaderOptions& options);

  bool read(std::vector<Event>& events) override;
  void seek(std::int64_t t_ns) override;
  std::string positionOf(std::size_t index) const override;
  std::string name() const override { return columns_.t.array->name(); }
  double progress() const override;
  std::optional<CameraSize> size() const override { return columns_.size; }
  std::vector<Warning> warnings() const override { return columns_.warnings; }

 private:
  std::size_t readRows(std::size_t max_rows);
  void seekRow(std::uint64_t row);
  int findExponent(const ReaderOptions& options);
  Event eventAt(std::size_t row) const;
  std::uint16_t pixel(const NpyColumn& column, std::size_t row, const char* name) const;

  NpyEventColumns columns_;
  std::vector<std::shared_ptr<NpyArray>> arrays_;  // each once
  std::size_t block_rows_;
  int time_exponent_ = 0;
  std::uint64_t begin_ = 0;  // row of the block
};

}  // namespace efm
