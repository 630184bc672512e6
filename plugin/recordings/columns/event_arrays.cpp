// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/columns/event_arrays.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/streams/file_content.h"
#include "plugin/recordings/streams/time_unit.h"
#include "plugin/recordings/text/event_columns.h"

namespace efm {
namespace {

constexpr std::size_t kBlockRows = std::size_t{1} << 16;
constexpr std::size_t kArrayBlockBytes = std::size_t{1} << 23;

namespace fs = std::filesystem;

/// An array of a file that is no archive, or of an archive.
struct FoundArray {
  std::string member;  // with ".npy"; empty: the file itself
  NpyHeader header;

  std::string name() const { return fs::path(member).stem().string(); }
};

std::string shapeOf(const NpyHeader& header) {
  std::string fields;
  for (const NpyField& field : header.fields) fields += " " + field.name;
  return fmt::format("({}){}{}", fmt::join(header.shape, ", "),
                     header.structured ? " with fields" : "", fields);
}

bool isMatrix(const NpyHeader& header) {
  const std::vector<std::uint64_t>& shape = header.shape;
  return !header.structured && shape.size() == 2 && shape[0] > 0 && shape[1] > 0;
}

/// Whether each number of an event stands in a row of its own.
bool isLying(const std::vector<std::uint64_t>& shape, std::size_t columns) {
  return shape[1] != columns && shape[0] == columns;
}

/// Whether the array has the numbers of all events.
/// @param columns of an event, as the option says: 4 or more, or 0 where they have names.
bool hasEvents(const NpyHeader& header, std::size_t columns) {
  if (header.structured) return !header.fields.empty();
  return isMatrix(header) && (header.shape[1] == columns || isLying(header.shape, columns));
}

bool hasPoses(const NpyHeader& header) {
  const std::vector<std::uint64_t>& shape = header.shape;
  if (header.structured) return false;
  if (shape.size() == 3) return shape[1] == 4 && shape[2] == 4;
  return shape.size() == 2 && (shape[1] == 7 || shape[1] == 8);
}

/// The columns of an event in `--event-columns`: its letters, or 0 for names. Without it 4.
std::size_t columnsOf(const ReaderOptions& options) {
  if (options.columns.find('=') != std::string::npos) return 0;
  const auto letters = std::count_if(options.columns.begin(), options.columns.end(),
                                     [](char c) { return c != ' ' && c != ','; });
  return std::max<std::size_t>(4, static_cast<std::size_t>(letters));
}

/// The names that mean t, x, y and p: those of the option, or the only ones that mean it by
/// themselves.
/// @return nothing where one is missing, or two mean the same.
std::optional<EventNames> namesOf(const std::vector<std::string>& all,
                                  const ReaderOptions& options) {
  const auto has = [&](const std::string& name) {
    return std::find(all.begin(), all.end(), name) != all.end();
  };
  if (const auto names = eventNamesOf(options.columns)) {
    const bool complete = has(names->t) && has(names->x) && has(names->y) && has(names->p);
    return complete ? names : std::nullopt;
  }
  EventNames names;
  for (const std::string& name : all) {
    const char column = eventColumnOf(headerWord(name));
    std::string* const found = column == 't'   ? &names.t
                               : column == 'x' ? &names.x
                               : column == 'y' ? &names.y
                               : column == 'p' ? &names.p
                                               : nullptr;
    if (found == nullptr) continue;
    if (!found->empty()) return std::nullopt;
    *found = name;
  }
  const bool complete =
      !names.t.empty() && !names.x.empty() && !names.y.empty() && !names.p.empty();
  return complete ? std::optional(names) : std::nullopt;
}

/// The position of a name among all.
std::size_t indexOf(const std::string& name, const std::vector<std::string>& all) {
  return static_cast<std::size_t>(std::find(all.begin(), all.end(), name) - all.begin());
}

[[noreturn]] void refuse(const fs::path& file, const std::vector<FoundArray>& arrays,
                         const ReaderOptions& options) {
  std::string all;
  for (const FoundArray& array : arrays) {
    all += fmt::format("{}{}{}{}", all.empty() ? "" : ", ", array.name(),
                       array.member.empty() ? "" : " ", shapeOf(array.header));
  }
  if (std::any_of(arrays.begin(), arrays.end(),
                  [](const FoundArray& array) { return hasPoses(array.header); })) {
    throw std::runtime_error(
        fmt::format("{}: {}: poses: expected --poses {}", file.string(), all, file.string()));
  }
  const std::string given =
      options.columns.empty() ? "" : "; --event-columns '" + options.columns + "' names others";
  throw std::runtime_error(fmt::format(
      "{}: {}{}: expected events: N x 4 numbers, a structured array with fields t, x, y and p, or "
      "a "
      ".npz file with arrays t, x, y and p (other names: --event-columns \"t=NAME x=NAME y=NAME "
      "p=NAME\")",
      file.string(), all.empty() ? "no arrays" : all, given));
}

/// Whether it is the type of Metavision's events, whose times are microseconds.
bool isMetavision(const std::vector<NpyField>& fields) {
  constexpr struct {
    const char* name;
    NumberType type;
  } kFields[] = {{"x", NumberType::kUint16},
                 {"y", NumberType::kUint16},
                 {"p", NumberType::kInt16},
                 {"t", NumberType::kInt64}};
  return std::equal(fields.begin(), fields.end(), std::begin(kFields), std::end(kFields),
                    [](const NpyField& field, const auto& expected) {
                      return field.name == expected.name && field.type == expected.type;
                    });
}

/// The columns with these names; the name of t may say its unit.
template <typename ColumnOf>
NpyEventColumns columnsNamed(const EventNames& names, const ColumnOf& column) {
  NpyEventColumns columns;
  columns.t = column(names.t);
  columns.x = column(names.x);
  columns.y = column(names.y);
  columns.p = column(names.p);
  columns.time_exponent = headerWord(names.t).time_exponent;
  return columns;
}

/// The columns of a structured array.
NpyEventColumns fieldsOf(const fs::path& file, const FoundArray& found,
                         const ReaderOptions& options) {
  std::vector<std::string> all;
  for (const NpyField& field : found.header.fields) all.push_back(field.name);
  const std::optional<EventNames> names = namesOf(all, options);
  if (!names) refuse(file, {found}, options);
  const auto array = std::make_shared<NpyArray>(file, found.member, NpyPart{true, {}, false});
  NpyEventColumns columns = columnsNamed(*names, [&](const std::string& name) {
    return NpyColumn{array, indexOf(name, all)};
  });
  if (isMetavision(found.header.fields)) columns.time_exponent = -6;
  return columns;
}

/// The columns of N x 4 or 4 x N numbers.
NpyEventColumns matrixColumnsOf(const fs::path& file, const FoundArray& found,
                                const ReaderOptions& options) {
  const std::size_t count = columnsOf(options);
  const bool lying = isLying(found.header.shape, count);
  std::vector<NpyColumn> all;
  if (lying != found.header.fortran_order) {
    for (std::size_t k = 0; k < count; ++k) {
      all.push_back({std::make_shared<NpyArray>(file, found.member, NpyPart{false, k, false}), 0});
    }
  } else {
    // Rows one after the other: of N x 4 in C order, or of 4 x N in Fortran order.
    const auto array = std::make_shared<NpyArray>(file, found.member, NpyPart{false, {}, lying});
    for (std::size_t k = 0; k < count; ++k) all.push_back({array, k});
  }
  constexpr std::size_t kSample = 5000;
  EventRows rows;
  for (const NpyColumn& column : all) {
    const std::size_t sampled = column.array->sampleRows(kSample);
    rows.resize(&column == &all.front() ? sampled : std::min(rows.size(), sampled));
    for (std::size_t row = 0; row < rows.size(); ++row) {
      rows[row].push_back(column.array->number(row, column.index));
    }
  }
  NpyEventColumns columns;
  const std::string order = findColumnOrder(rows, options, file.string(), columns.warnings);
  columns.t = all[order.find('t')];
  columns.x = all[order.find('x')];
  columns.y = all[order.find('y')];
  columns.p = all[order.find('p')];
  return columns;
}

/// The columns of an array each; nothing where the archive has not all of them.
std::optional<NpyEventColumns> separateColumnsOf(const fs::path& file,
                                                 const std::vector<FoundArray>& arrays,
                                                 const ReaderOptions& options) {
  std::vector<std::string> names_of_lists;
  std::vector<std::string> members;
  for (const FoundArray& array : arrays) {
    const std::vector<std::uint64_t>& shape = array.header.shape;
    const bool is_list = shape.size() == 1 || (shape.size() == 2 && shape[1] == 1);
    if (!is_list || array.header.structured) continue;
    names_of_lists.push_back(array.name());
    members.push_back(array.member);
  }
  const std::optional<EventNames> names = namesOf(names_of_lists, options);
  if (!names) return std::nullopt;
  return columnsNamed(*names, [&](const std::string& name) {
    return NpyColumn{std::make_shared<NpyArray>(file, members[indexOf(name, names_of_lists)]), 0};
  });
}

NpyEventColumns eventColumnsOf(const fs::path& file, const ReaderOptions& options) {
  std::vector<FoundArray> arrays;
  if (beginsWith(file, "PK")) {
    for (const std::string& member : membersOf(file)) {
      try {
        arrays.push_back({member, readNpyHeader(file, member)});
      } catch (const std::runtime_error&) {  // Python objects, beside the events
      }
    }
    if (auto columns = separateColumnsOf(file, arrays, options)) return *std::move(columns);
  } else {
    arrays.push_back({"", readNpyHeader(file)});
  }
  std::vector<FoundArray> with_events;
  for (const FoundArray& array : arrays) {
    if (hasEvents(array.header, columnsOf(options))) with_events.push_back(array);
  }
  if (with_events.size() != 1) refuse(file, arrays, options);
  const FoundArray& found = with_events.front();
  return found.header.structured ? fieldsOf(file, found, options)
                                 : matrixColumnsOf(file, found, options);
}

class ArrayEvents : public EventStream {
 public:
  ArrayEvents(NpyEventColumns columns, const ReaderOptions& options)
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

  bool read(std::vector<Event>& events) override {
    events.clear();
    begin_ = columns_.t.array->position();
    const std::size_t rows = readRows(block_rows_);
    events.reserve(rows);
    for (std::size_t row = 0; row < rows; ++row) events.push_back(eventAt(row));
    return rows > 0;
  }
  void seek(std::int64_t t_ns) override {
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
  std::string positionOf(std::size_t index) const override {
    return fmt::format("{}: row {}", name(), begin_ + index);
  }
  std::string name() const override { return columns_.t.array->name(); }
  double progress() const override {
    const NpyArray& times = *columns_.t.array;
    return times.rows() == 0
               ? 1
               : static_cast<double>(times.position()) / static_cast<double>(times.rows());
  }
  std::optional<CameraSize> size() const override { return columns_.size; }
  std::vector<Warning> warnings() const override { return columns_.warnings; }

 private:
  std::size_t readRows(std::size_t max_rows) {
    std::size_t rows = 0;
    for (const auto& array : arrays_) rows = array->readRows(max_rows);
    return rows;
  }
  void seekRow(std::uint64_t row) {
    for (const auto& array : arrays_) array->seek(row);
  }
  int findExponent(const ReaderOptions& options) {
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
  Event eventAt(std::size_t row) const {
    const NpyColumn& t = columns_.t;
    const std::optional<std::int64_t> t_ns = t.array->time(row, t.index, time_exponent_);
    if (!t_ns) {
      throw t.array->failure(
          begin_ + row,
          fmt::format("t = {}: expected {}", t.array->number(row, t.index), kExpectedTime));
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
  std::uint16_t pixel(const NpyColumn& column, std::size_t row, const char* name) const {
    const double value = column.array->number(row, column.index);
    if (const auto pixel = wholeNumber(value, 0, 65'535)) return static_cast<std::uint16_t>(*pixel);
    throw column.array->failure(
        begin_ + row, fmt::format("{} = {}: expected a whole number from 0 to 65535", name, value));
  }

  NpyEventColumns columns_;
  std::vector<std::shared_ptr<NpyArray>> arrays_;  // each once
  std::size_t block_rows_;
  int time_exponent_ = 0;
  std::uint64_t begin_ = 0;  // row of the block
};

}  // namespace

std::unique_ptr<EventStream> openArrayEvents(NpyEventColumns columns,
                                             const ReaderOptions& options) {
  return std::make_unique<ArrayEvents>(std::move(columns), options);
}

bool looksLikeNumpy(const fs::path& file) {
  if (!isFile(file)) return false;
  try {
    if (beginsWith(file, "PK")) {
      const std::vector<std::string> members = membersOf(file);
      return !members.empty() &&
             std::all_of(members.begin(), members.end(), [](const std::string& member) {
               return fs::path(member).extension() == ".npy";
             });
    }
    std::string bytes(8, '\0');
    FileContent content(file);
    bytes.resize(content.read(bytes.data(), bytes.size()));
    return looksLikeNpy(bytes);
  } catch (const std::exception&) {
    return false;
  }
}

RecordingParts openEventArrays(const std::vector<fs::path>& files, const ReaderOptions& options) {
  RecordingParts parts;
  for (const fs::path& file : files) {
    NpyEventColumns columns = eventColumnsOf(file, options);
    if (!options.time_unit.empty()) columns.time_exponent.reset();  // as for text
    parts.cameras.push_back(std::make_unique<ArrayEvents>(std::move(columns), options));
  }
  return parts;
}

}  // namespace efm
