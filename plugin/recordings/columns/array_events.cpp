// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/columns/array_events.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/streams/number_checks.h"
#include "plugin/recordings/streams/time_unit.h"

namespace efm {
namespace {

constexpr std::size_t kBlockRows = std::size_t{1} << 16;
constexpr std::size_t kArrayBlockBytes = std::size_t{1} << 23;

}  // namespace

ArrayEvents::ArrayEvents(NpyEventColumns columns, const ReaderOptions& options)
    : columns_(std::move(columns)), block_rows_(kBlockRows) {
  for (const NpyColumn* column : {&columns_.t, &columns_.x, &columns_.y, &columns_.p}) {
    const std::shared_ptr<NpyArray>& array = column->array;
    if (std::find(arrays_.begin(), arrays_.end(), array) != arrays_.end()) continue;
    const std::uint64_t rows = columns_.t.array->rows();
    if (array->rows() != rows) {
      throw std::runtime_error(fmt::format("{}: {} rows: expected {}, as {} has", array->name(),
                                           array->rows(), rows, name()));
    }
    arrays_.push_back(array);
    block_rows_ = std::clamp<std::size_t>(
        kArrayBlockBytes / std::max<std::size_t>(1, array->rowBytes()), 1, block_rows_);
  }
  time_exponent_ = columns_.time_exponent ? *columns_.time_exponent : findExponent(options);
}

std::size_t ArrayEvents::readRows(std::size_t max_rows) {
  std::size_t rows = 0;
  for (const auto& array : arrays_) rows = array->readRows(max_rows);
  return rows;
}

void ArrayEvents::seekRow(std::uint64_t row) {
  for (const auto& array : arrays_) array->seek(row);
}

bool ArrayEvents::read(std::vector<Event>& events) {
  events.clear();
  begin_ = columns_.t.array->position();
  const std::size_t rows = readRows(block_rows_);
  events.reserve(rows);
  for (std::size_t row = 0; row < rows; ++row) events.push_back(eventAt(row));
  return rows > 0;
}

void ArrayEvents::seek(std::int64_t t_ns) {
  NpyArray& times = *columns_.t.array;
  if (!std::all_of(arrays_.begin(), arrays_.end(),
                   [](const auto& array) { return array->canSeek(); })) {
    return;
  }
  // An event of t_ns or later is not before one that is more than 10 ms older.
  const std::int64_t before_ns = t_ns - kMaxEventDelayNs;
  std::uint64_t low = 0;
  std::uint64_t high = times.rows();
  while (low < high) {
    const std::uint64_t middle = low + (high - low) / 2;
    times.seek(middle);
    times.readRows(1);
    const std::optional<std::int64_t> t = times.time(0, columns_.t.index, time_exponent_);
    if (t && *t < before_ns) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  seekRow(low);
}

std::string ArrayEvents::positionOf(std::size_t index) const {
  return fmt::format("{}: row {}", name(), begin_ + index);
}

double ArrayEvents::progress() const {
  const NpyArray& times = *columns_.t.array;
  return times.rows() == 0
             ? 1
             : static_cast<double>(times.position()) / static_cast<double>(times.rows());
}

int ArrayEvents::findExponent(const ReaderOptions& options) {
  constexpr std::size_t kSample = 5000;
  const NpyColumn& t = columns_.t;
  TimeSample sample;
  const std::size_t rows = t.array->sampleRows(std::min(kSample, block_rows_));
  for (std::size_t row = 0; row < rows; ++row) {
    sample.add(t.array->number(row, t.index));
  }
  TimeUnit unit = findTimeUnit(options, sample, kUsualEventRate, name());
  if (unit.warning) columns_.warnings.push_back(std::move(*unit.warning));
  return unit.exponent;
}

Event ArrayEvents::eventAt(std::size_t row) const {
  const NpyColumn& t = columns_.t;
  const std::optional<std::int64_t> t_ns = t.array->time(row, t.index, time_exponent_);
  if (!t_ns) {
    throw t.array->failure(begin_ + row, fmt::format("t = {}: expected {}",
                                                     t.array->number(row, t.index), kExpectedTime));
  }
  const double polarity = columns_.p.array->number(row, columns_.p.index);
  if (polarity != 0 && std::abs(polarity) != 1) {
    throw columns_.p.array->failure(
        begin_ + row, fmt::format("p = {}: expected polarity 0 or 1, or -1 or 1", polarity));
  }
  Event event;
  event.t_ns = *t_ns;
  event.x = pixel(columns_.x, row, "x");
  event.y = pixel(columns_.y, row, "y");
  event.polarity = (polarity == 1) != columns_.inverted;
  return event;
}

std::uint16_t ArrayEvents::pixel(const NpyColumn& column, std::size_t row, const char* name) const {
  const double value = column.array->number(row, column.index);
  if (const auto pixel = wholeNumber(value, 0, 65'535)) return static_cast<std::uint16_t>(*pixel);
  throw column.array->failure(
      begin_ + row, fmt::format("{} = {}: expected a whole number from 0 to 65535", name, value));
}

}  // namespace efm
