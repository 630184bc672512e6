// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/columns/event_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <string_view>
#include <utility>

#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

constexpr std::int64_t kMillisecondNs = 1'000'000;
constexpr std::int64_t kMaxPixel = std::numeric_limits<std::uint16_t>::max();

/// The first wrong number of a block.
struct RejectedNumber {
  std::size_t event;
  char column;
};

class TableEvents : public EventStream {
 public:
  TableEvents(EventTable table, const ReaderOptions& options)
      : table_(std::move(table)), count_(table_.column('t').rows->size()) {
    if (!table_.time_unit_ns) findUnit(options);
  }

  bool decode(std::vector<Event>& events) override {
    constexpr std::size_t kBlockEvents = 65'536;
    events.clear();
    first_ = next_;
    while (events.size() < kBlockEvents && next_ < count_) append(events);
    return !events.empty();
  }
  /// If an event is too early, all events before it are too early, too: the caller has subtracted
  /// the largest delay of events. So the index is used if the event before it is too early, and
  /// bisection works without a complete order of the events.
  void seek(std::int64_t t_ns) override {
    for (const char letter : order()) {
      if (!column(letter).rows->canSeek()) return;
    }
    t_ns -= table_.seek_margin_ns;
    const auto is_early = [&](std::uint64_t event) {
      const std::optional<std::int64_t> event_ns = column('t').time(event, *table_.time_unit_ns);
      if (event_ns) return *event_ns + table_.offset_ns < t_ns;
      if (table_.place.empty()) return false;  // `read` reports the error
      throw std::runtime_error(placeOf(event, 't') + ": t: expected " + kExpectedTime);
    };
    std::uint64_t begin = 0;  // all events before it are too early
    std::uint64_t end = count_;
    if (const auto event = indexed(t_ns)) {
      if (*event == 0 || is_early(*event - 1)) {
        next_ = *event;
        return;
      }
      end = *event - 1;
    }
    while (begin < end) {
      const std::uint64_t middle = begin + (end - begin) / 2;
      if (is_early(middle)) {
        begin = middle + 1;
      } else {
        end = middle;
      }
    }
    next_ = begin;
  }
  std::string positionOf(std::size_t index) const override { return placeOf(first_ + index, 't'); }
  std::string name() const override { return table_.name; }
  double progress() const override {
    return count_ == 0 ? 1 : static_cast<double>(next_) / static_cast<double>(count_);
  }
  std::optional<CameraSize> size() const override { return table_.size; }
  std::vector<Warning> warnings() const override { return table_.warnings; }

 private:
  /// If an event has several wrong numbers, the first one in this order is reported.
  std::string_view order() const { return table_.place.empty() ? "tpxy" : "xytp"; }
  const RowColumn& column(char letter) const { return table_.columns[kEventColumns.find(letter)]; }
  std::string placeOf(std::uint64_t event, char letter) const {
    return table_.place.empty() ? column(letter).rows->placeOf(event)
                                : fmt::format("{}[{}]", table_.place, event);
  }
  /// Finds the unit from the times of the first block.
  void findUnit(const ReaderOptions& options) {
    TimeSample sample;
    const RowColumn& t = column('t');
    const std::size_t rows = sampledRows(t);
    for (std::size_t row = 0; row < rows; ++row) sample.add(t.number(row));
    TimeUnit unit = findTimeUnit(options, sample, kUsualEventRate, table_.times);
    table_.time_unit_ns = nanosecondsPer(unit.exponent);
    if (unit.warning) table_.warnings.push_back(std::move(*unit.warning));
  }
  /// Appends the events up to the first end of a column's block.
  void append(std::vector<Event>& events) {
    constexpr std::uint64_t kMaxEvents = 131'072;
    std::uint64_t end = std::min(count_, next_ + kMaxEvents);
    for (const char letter : order()) {
      end = std::min(end, column(letter).rows->blockAt(next_).end);
    }
    const auto count = static_cast<std::size_t>(end - next_);
    const std::size_t before = events.size();
    events.resize(before + count);
    std::optional<RejectedNumber> rejected;
    for (const char letter : order()) {
      const std::size_t valid =
          setColumn(letter, column(letter).from(next_), count, events.data() + before);
      if (valid < count && (!rejected || valid < rejected->event)) rejected = {valid, letter};
    }
    if (rejected) {
      events.resize(before + rejected->event);
      throw failure(next_ + rejected->event, rejected->column);
    }
    next_ = end;
  }
  /// Sets one field of the events from a column.
  /// @return the index of the first wrong number, else `count`.
  std::size_t setColumn(char letter, const Column& numbers, std::size_t count,
                        Event* events) const {
    const auto set_pixels = [&](std::uint16_t Event::*field) {
      return numbers.forEach(count, [=](std::size_t i, auto number) {
        const auto pixel = wholeNumber(number, 0, kMaxPixel);
        events[i].*field = static_cast<std::uint16_t>(pixel.value_or(0));
        return pixel.has_value();
      });
    };
    if (letter == 'x') return set_pixels(&Event::x);
    if (letter == 'y') return set_pixels(&Event::y);
    if (letter == 'p') {
      return numbers.forEach(count, [=, inverted = table_.inverted](std::size_t i, auto number) {
        events[i].polarity = (number == 1) != inverted;
        return wholeNumber(number, -1, 1).has_value();
      });
    }
    return numbers.forEach(count, [=, unit_ns = *table_.time_unit_ns, offset_ns = table_.offset_ns](
                                      std::size_t i, auto number) {
      const auto t_ns = nanoseconds(number, unit_ns);
      events[i].t_ns = t_ns.value_or(0) + offset_ns;
      return t_ns && events[i].t_ns > -kEndOfTimeNs && events[i].t_ns < kEndOfTimeNs;
    });
  }
  std::runtime_error failure(std::uint64_t event, char letter) const {
    const bool of_arrays = table_.place.empty();
    std::string value;
    double real = 0;
    column(letter).from(event).forEach(1, [&](std::size_t, auto number) {
      real = static_cast<double>(number);
      value =
          of_arrays ? fmt::format("{}", static_cast<double>(number)) : fmt::format("'{}'", number);
      return true;
    });
    const std::string expected = letter == 't'   ? kExpectedTime
                                 : letter != 'p' ? expectedPixel(real)
                                 : of_arrays     ? "polarity 0 or 1, or -1 or 1"
                                                 : "polarity 1, 0 or -1";
    return std::runtime_error(
        fmt::format("{}: {} = {}: expected {}", placeOf(event, letter), letter, value, expected));
  }
  /// Returns the first event of the millisecond that contains a time, from the file's index.
  std::optional<std::uint64_t> indexed(std::int64_t t_ns) const {
    if (!table_.index || table_.index->rows->size() == 0) return std::nullopt;
    const std::int64_t since_ns = std::max<std::int64_t>(0, t_ns - table_.offset_ns);
    const auto millisecond = std::min<std::uint64_t>(
        static_cast<std::uint64_t>(since_ns / kMillisecondNs), table_.index->rows->size() - 1);
    std::optional<std::int64_t> event;
    table_.index->from(millisecond).forEach(1, [&](std::size_t, auto number) {
      event = wholeNumber(number, 0, static_cast<std::int64_t>(count_));
      return true;
    });
    return event;
  }

  EventTable table_;
  std::uint64_t count_;
  std::uint64_t first_ = 0;  // first event of the last block
  std::uint64_t next_ = 0;
};

}  // namespace

std::optional<std::int64_t> RowColumn::time(std::uint64_t row, std::int64_t unit_ns) const {
  std::optional<std::int64_t> t_ns;
  from(row).forEach(1, [&](std::size_t, auto number) {
    t_ns = nanoseconds(number, unit_ns);
    return true;
  });
  return t_ns;
}

std::unique_ptr<EventStream> eventsOf(EventTable table, const ReaderOptions& options) {
  return std::make_unique<TableEvents>(std::move(table), options);
}

std::size_t sampledRows(const RowColumn& column) {
  constexpr std::uint64_t kSample = 5000;
  if (column.rows->size() == 0) return 0;
  return static_cast<std::size_t>(std::min(column.rows->blockAt(0).end, kSample));
}

}  // namespace efm
