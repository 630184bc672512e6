// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/columns/hdf5_events.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/streams/time_unit.h"

namespace efm {
namespace {

constexpr std::int64_t kMillisecondNs = 1'000'000;

/// A number of a file that is wrong.
struct RefusedNumber {
  std::size_t index;  ///< Of the event.
  std::string message;
};

/// Sets a part of the events from a column.
/// @param set sets it in an event from a number; returns false if the number is wrong.
/// @param refused the first wrong number so far; a number of an earlier event replaces it.
template <typename Set>
void setEvents(const Hdf5Column& column, std::uint64_t first, std::size_t count, Event* events,
               const char* name, const char* expected, std::optional<RefusedNumber>& refused,
               const Set& set) {
  const std::size_t valid = column.forEach(
      first, count, [&](std::size_t i, auto number) { return set(events[i], number); });
  if (valid == count || (refused && refused->index <= valid)) return;
  column.forEach(first + valid, 1, [&](std::size_t, auto number) {
    refused = {valid, fmt::format("{} = '{}': expected {}", name, number, expected)};
    return true;
  });
}

class Hdf5EventStream : public EventStream {
 public:
  Hdf5EventStream(std::shared_ptr<const Hdf5File> file, const Hdf5Layout& layout,
                  const std::string& camera, std::optional<CameraSize> size,
                  const ReaderOptions& options)
      : file_(std::move(file)),
        place_(camera + layout.signature()),
        size_(size),
        unit_ns_(layout.time_unit_ns) {
    if (layout.events.empty()) place_.resize(place_.rfind('/'));
    openColumns(layout, camera);
    count_ = columns_[kX].size();
    const bool of_layout =
        unit_ns_ == kNanosecondsPerSecond || (unit_ns_ != 0 && !columns_[kT].isReal());
    if (!of_layout) findUnit(options);
    if (!layout.offset.empty() && file_->has(camera + layout.offset)) {
      const std::string path = camera + layout.offset;
      const std::int64_t offset = file_->integer(path);
      const auto offset_ns = nanoseconds(offset, layout.time_unit_ns);
      if (!offset_ns) throw file_->fail(path, fmt::format("{}: expected a time", offset));
      offset_ns_ = *offset_ns;
    }
    if (!layout.index.empty() && file_->has(camera + layout.index)) {
      index_ = Hdf5Column::ofMatrix(std::make_shared<Hdf5Rows>(file_, camera + layout.index), 0);
    }
  }

  bool read(std::vector<Event>& events) override {
    constexpr std::size_t kBlockEvents = 65'536;
    events.clear();
    first_ = next_;
    while (events.size() < kBlockEvents && next_ < count_) append(events);
    return !events.empty();
  }
  /// An event that is too early proves that all events before it are too early, too, up to the
  /// delay that the caller subtracts. So the index is believed where it holds, and bisection needs
  /// no order of all events.
  void seek(std::int64_t t_ns) override {
    const auto is_early = [&](std::uint64_t event) { return timeAt(event) < t_ns; };
    std::uint64_t begin = 0;  // the events before it are too early
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
  std::string positionOf(std::size_t index) const override {
    return positionInFile(first_ + index);
  }
  std::string name() const override { return file_->path().string(); }
  double progress() const override {
    return count_ == 0 ? 1 : static_cast<double>(next_) / static_cast<double>(count_);
  }
  std::optional<CameraSize> size() const override { return size_; }
  std::vector<Warning> warnings() const override { return warnings_; }

 private:
  enum Column : std::size_t { kX, kY, kT, kP };

  void openColumns(const Hdf5Layout& layout, const std::string& camera) {
    std::shared_ptr<Hdf5Rows> rows;
    if (!layout.events.empty()) rows = std::make_shared<Hdf5Rows>(file_, camera + layout.events);
    for (std::size_t i = 0; i < layout.columns.size(); ++i) {
      const std::string& column = layout.columns[i];
      if (!rows) {
        columns_.push_back(
            Hdf5Column::ofMatrix(std::make_shared<Hdf5Rows>(file_, camera + column), 0));
      } else if (column.empty()) {
        columns_.push_back(Hdf5Column::ofMatrix(rows, i));
      } else {
        columns_.push_back(Hdf5Column::ofField(rows, column));
      }
      if (columns_[i].size() != columns_[kX].size()) {
        throw columns_[i].rows().fail(fmt::format("{} numbers: expected {}, as many as {}{} has",
                                                  columns_[i].size(), columns_[kX].size(), camera,
                                                  layout.columns[kX]));
      }
    }
  }
  /// Finds the unit from the times of the first block.
  void findUnit(const ReaderOptions& options) {
    constexpr std::uint64_t kSample = 5000;
    TimeSample sample;
    if (count_ > 0) {
      const auto rows = std::min(columns_[kT].rows().blockAt(0).end, kSample);
      columns_[kT].forEach(0, static_cast<std::size_t>(rows), [&](std::size_t, auto number) {
        sample.add(static_cast<double>(number));
        return true;
      });
    }
    TimeUnit unit = findTimeUnit(options, sample, kUsualEventRate,
                                 fmt::format("{}:{}", name(), columns_[kT].rows().path()));
    unit_ns_ = nanosecondsPer(unit.exponent);
    if (unit.warning) warnings_.push_back(std::move(*unit.warning));
  }
  /// Appends the events up to the next end of a chunk.
  void append(std::vector<Event>& events) {
    constexpr std::uint64_t kMaxEvents = 131'072;
    std::uint64_t end = std::min(count_, next_ + kMaxEvents);
    for (const Hdf5Column& column : columns_) {
      end = std::min(end, column.rows().blockAt(next_).end);
    }
    const auto count = static_cast<std::size_t>(end - next_);
    const std::size_t before = events.size();
    events.resize(before + count);
    Event* const added = events.data() + before;

    std::optional<RefusedNumber> refused;
    const auto pixel = [](std::uint16_t Event::*field) {
      return [field](Event& event, auto number) {
        constexpr std::int64_t kMaxPixel = std::numeric_limits<std::uint16_t>::max();
        const auto value = wholeNumber(number, 0, kMaxPixel);
        event.*field = static_cast<std::uint16_t>(value.value_or(0));
        return value.has_value();
      };
    };
    const char* const any_pixel = "a whole number from 0 to 65535";
    setEvents(columns_[kX], next_, count, added, "x", any_pixel, refused, pixel(&Event::x));
    setEvents(columns_[kY], next_, count, added, "y", any_pixel, refused, pixel(&Event::y));
    setEvents(columns_[kT], next_, count, added, "t", kExpectedTime, refused,
              [unit_ns = unit_ns_, offset_ns = offset_ns_](Event& event, auto number) {
                const auto t_ns = nanoseconds(number, unit_ns);
                event.t_ns = t_ns.value_or(0) + offset_ns;
                return t_ns && event.t_ns > -kEndOfTimeNs && event.t_ns < kEndOfTimeNs;
              });
    setEvents(columns_[kP], next_, count, added, "p", "polarity 1, 0 or -1", refused,
              [](Event& event, auto number) {
                event.polarity = number == 1;
                return wholeNumber(number, -1, 1).has_value();
              });
    if (refused) {
      events.resize(before + refused->index);
      throw std::runtime_error(positionInFile(next_ + refused->index) + ": " + refused->message);
    }
    next_ = end;
  }
  std::int64_t timeAt(std::uint64_t index) const {
    std::optional<std::int64_t> t_ns;
    columns_[kT].forEach(index, 1, [&](std::size_t, auto number) {
      t_ns = nanoseconds(number, unit_ns_);
      return true;
    });
    if (!t_ns) throw std::runtime_error(positionInFile(index) + ": t: expected " + kExpectedTime);
    return *t_ns + offset_ns_;
  }
  /// The first event of the millisecond that contains a time, as the file's index says.
  std::optional<std::uint64_t> indexed(std::int64_t t_ns) const {
    if (!index_ || index_->size() == 0) return std::nullopt;
    const std::int64_t since_ns = std::max<std::int64_t>(0, t_ns - offset_ns_);
    const auto millisecond = std::min<std::uint64_t>(
        static_cast<std::uint64_t>(since_ns / kMillisecondNs), index_->size() - 1);
    std::optional<std::int64_t> event;
    index_->forEach(millisecond, 1, [&](std::size_t, auto number) {
      event = wholeNumber(number, 0, static_cast<std::int64_t>(count_));
      return true;
    });
    if (!event) return std::nullopt;
    return static_cast<std::uint64_t>(*event);
  }
  std::string positionInFile(std::uint64_t index) const {
    return fmt::format("{}:{}[{}]", file_->path().string(), place_, index);
  }

  std::shared_ptr<const Hdf5File> file_;
  std::string place_;  // of the events in the file, for errors
  std::optional<CameraSize> size_;
  std::int64_t unit_ns_;
  std::int64_t offset_ns_ = 0;
  std::vector<Hdf5Column> columns_;  // x, y, t, p
  std::optional<Hdf5Column> index_;  // of milliseconds
  std::vector<Warning> warnings_;
  std::uint64_t count_ = 0;
  std::uint64_t first_ = 0;  // event of the last block
  std::uint64_t next_ = 0;
};

}  // namespace

const std::vector<Hdf5Layout>& hdf5Layouts() {
  static const std::vector<Hdf5Layout> all = {
      // TUM-VIE's sensors have 1280x720 pixels, DSEC's and VECtor's 640x480.
      {"DSEC, TUM-VIE, VECtor",
       {""},
       "",
       {"/events/x", "/events/y", "/events/t", "/events/p"},
       kNanosecondsPerMicrosecond,
       "/ms_to_idx",
       "/t_offset",
       std::nullopt},
      {"E2VID",
       {""},
       "",
       {"/events/xs", "/events/ys", "/events/ts", "/events/ps"},
       0,
       "",
       "",
       std::nullopt},
      {"M3ED",
       {"/prophesee/left", "/prophesee/right"},
       "",
       {"/x", "/y", "/t", "/p"},
       kNanosecondsPerMicrosecond,
       "/ms_map_idx",
       "",
       CameraSize{1280, 720}},
      {"MVSEC",
       {"/davis/left", "/davis/right"},
       "/events",
       {},
       kNanosecondsPerSecond,
       "",
       "",
       CameraSize{346, 260}},
      {"Metavision",
       {""},
       "/CD/events",
       {"x", "y", "t", "p"},
       kNanosecondsPerMicrosecond,
       "",
       "",
       std::nullopt},
  };
  return all;
}

std::unique_ptr<EventStream> openHdf5Events(std::shared_ptr<const Hdf5File> file,
                                            const Hdf5Layout& layout, const std::string& camera,
                                            std::optional<CameraSize> size,
                                            const ReaderOptions& options) {
  return std::make_unique<Hdf5EventStream>(std::move(file), layout, camera, size, options);
}

}  // namespace efm
