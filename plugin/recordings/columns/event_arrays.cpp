// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/columns/event_arrays.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/files/file_content.h"
#include "plugin/recordings/streams/time_unit.h"
#include "plugin/recordings/text/event_columns.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

/// An array in an archive, or in a file of its own.
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

/// Returns whether a matrix has a row per column of the events, not a row per event.
bool isLying(const std::vector<std::uint64_t>& shape, std::size_t columns) {
  return shape[1] != columns && shape[0] == columns;
}

/// Returns whether the array has all numbers of all events.
/// @param columns number of columns in the option: 4 or more, or 0 if the columns have names.
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

/// Returns the number of letters in `--event-columns`, 0 for names, 4 without the option.
std::size_t columnsOf(const ReaderOptions& options) {
  if (options.columns.find('=') != std::string::npos) return 0;
  const auto letters = std::count_if(options.columns.begin(), options.columns.end(),
                                     [](char c) { return c != ' ' && c != ','; });
  return std::max<std::size_t>(4, static_cast<std::size_t>(letters));
}

/// Returns the names of t, x, y and p: the names in the option, else the only known name of each
/// column.
/// @return std::nullopt if a column is missing, or two names mean the same column.
std::optional<EventNames> namesOf(const std::vector<std::string>& all,
                                  const ReaderOptions& options) {
  const auto has = [&](const std::string& name) {
    return std::find(all.begin(), all.end(), name) != all.end();
  };
  if (const auto names = eventNamesOf(options.columns)) {
    return std::all_of(names->begin(), names->end(), has) ? names : std::nullopt;
  }
  EventNames names;
  for (const std::string& name : all) {
    const std::size_t column = kEventColumns.find(eventColumnOf(headerWord(name)));
    if (column == std::string_view::npos) continue;
    if (!names[column].empty()) return std::nullopt;
    names[column] = name;
  }
  return hasAll(names) ? std::optional(names) : std::nullopt;
}

/// Returns the index of a name in `all`.
std::size_t indexOf(const std::string& name, const std::vector<std::string>& all) {
  return static_cast<std::size_t>(std::find(all.begin(), all.end(), name) - all.begin());
}

[[noreturn]] void reject(const fs::path& file, const std::vector<FoundArray>& arrays,
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
  for (const FoundArray& pixels : arrays) {  // E-NeRF: position (N, 2)
    if (!isMatrix(pixels.header) || pixels.header.shape[1] != 2) continue;
    std::string others;
    for (const FoundArray& array : arrays) {
      const char column = eventColumnOf(headerWord(array.name()));
      if (column == 't' || column == 'p')
        others += fmt::format(", {}=z['{}']", column, array.name());
    }
    throw std::runtime_error(
        fmt::format("{}: {}: expected x and y in arrays of their own: python3 -c \"import numpy as "
                    "np; z = np.load('FILE'); np.savez('NEW.npz', x=z['{}'][:, 0], y=z['{}'][:, "
                    "1]{})\"",
                    file.string(), all, pixels.name(), pixels.name(), others));
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

/// Rejects events of several cameras: a field or array with the camera has several values.
/// @param column function that returns the column of a name.
template <typename ColumnNamed>
void requireOneCamera(const fs::path& file, const std::vector<std::string>& all,
                      const ColumnNamed& column) {
  for (const std::string& name : all) {
    if (eventColumnOf(headerWord(name)) != 'c') continue;
    const RowColumn cameras = column(name);
    const std::uint64_t count = cameras.rows->size();
    const double first = count > 0 ? cameras.number(0) : 0;
    for (std::uint64_t row = 1; row < count; ++row) {
      const double other = cameras.number(row);
      if (other == first) continue;
      throw std::runtime_error(
          fmt::format("{}: {} = {} and {}: expected the events of one camera in a file: those with "
                      "{} == {} (NumPy: e[e[\"{}\"] == {}])",
                      file.string(), name, first, other, name, first, name, first));
    }
  }
}

/// Returns whether the fields are those of Metavision, whose times are in microseconds.
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

/// Returns the columns with these names. The name of t may include its unit.
/// @param column function that returns the column of a name.
template <typename ColumnNamed>
EventTable tableOf(const EventNames& names, const ColumnNamed& column) {
  EventTable table;
  std::transform(names.begin(), names.end(), table.columns.begin(), column);
  const std::optional<int> exponent = headerWord(names.front()).time_exponent;
  if (exponent) table.time_unit_ns = nanosecondsPer(*exponent);
  return table;
}

/// Returns the columns of a structured array.
EventTable fieldsOf(const fs::path& file, const FoundArray& found, const ReaderOptions& options) {
  std::vector<std::string> all;
  for (const NpyField& field : found.header.fields) all.push_back(field.name);
  const std::optional<EventNames> names = namesOf(all, options);
  if (!names) reject(file, {found}, options);
  const auto array = std::make_shared<NpyArray>(file, found.member, NpyPart{true, {}, false});
  requireOneCamera(file, all, [&](const std::string& name) {
    const auto own = std::make_shared<NpyArray>(file, found.member, NpyPart{true, {}, false});
    return NpyArray::columnOf(own, indexOf(name, all));
  });
  EventTable table = tableOf(*names, [&](const std::string& name) {
    return NpyArray::columnOf(array, indexOf(name, all));
  });
  if (isMetavision(found.header.fields)) table.time_unit_ns = kNanosecondsPerMicrosecond;
  return table;
}

/// Returns the columns of N x 4 or 4 x N numbers.
EventTable matrixColumnsOf(const fs::path& file, const FoundArray& found,
                           const ReaderOptions& options) {
  const std::size_t count = columnsOf(options);
  const bool lying = isLying(found.header.shape, count);
  // True if the file stores event after event: N x 4 in C order, or 4 x N in Fortran order.
  const bool by_rows = lying == found.header.fortran_order;
  std::shared_ptr<NpyArray> array;
  std::vector<RowColumn> all;
  for (std::size_t k = 0; k < count; ++k) {
    if (!by_rows) array = std::make_shared<NpyArray>(file, found.member, NpyPart{false, k, false});
    if (!array) array = std::make_shared<NpyArray>(file, found.member, NpyPart{false, {}, lying});
    all.push_back(NpyArray::columnOf(array, by_rows ? k : 0));
  }
  EventRows rows(sampledRows(all.front()));
  for (const RowColumn& column : all) {
    for (std::size_t row = 0; row < rows.size(); ++row) rows[row].push_back(column.number(row));
  }
  EventTable table;
  const std::string order = findColumnOrder(rows, options, file.string(), table.warnings);
  for (const char column : kEventColumns) table.column(column) = all[order.find(column)];
  return table;
}

/// Returns columns that are one array each; std::nullopt if the archive does not have all four.
std::optional<EventTable> separateColumnsOf(const fs::path& file,
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
  const auto column = [&](const std::string& name) {
    return NpyArray::columnOf(
        std::make_shared<NpyArray>(file, members[indexOf(name, names_of_lists)]), 0);
  };
  requireOneCamera(file, names_of_lists, column);
  return tableOf(*names, column);
}

EventTable eventColumnsOf(const fs::path& file, const ReaderOptions& options) {
  std::vector<FoundArray> arrays;
  if (beginsWith(file, "PK")) {
    for (const std::string& member : membersOf(file)) {
      try {
        arrays.push_back({member, readNpyHeader(file, member)});
      } catch (const std::runtime_error&) {  // Python objects, beside the events
      }
    }
    if (auto table = separateColumnsOf(file, arrays, options)) return *std::move(table);
  } else {
    arrays.push_back({"", readNpyHeader(file)});
  }
  std::vector<FoundArray> with_events;
  for (const FoundArray& array : arrays) {
    if (hasEvents(array.header, columnsOf(options))) with_events.push_back(array);
  }
  if (with_events.size() != 1) reject(file, arrays, options);
  const FoundArray& found = with_events.front();
  return found.header.structured ? fieldsOf(file, found, options)
                                 : matrixColumnsOf(file, found, options);
}

std::vector<double> numbersOf(const fs::path& file, const char* member, std::size_t max_count) {
  const auto array = std::make_shared<NpyArray>(file, member);
  if (array->header().count() > max_count) {
    throw std::runtime_error(fmt::format("{}: {} numbers: expected at most {}", array->name(),
                                         array->header().count(), max_count));
  }
  std::vector<double> numbers;
  for (std::uint64_t row = 0; row < std::min<std::uint64_t>(array->size(), max_count); ++row) {
    for (std::size_t column = 0; column < array->columns(); ++column) {
      numbers.push_back(NpyArray::columnOf(array, column).number(row));
    }
  }
  return numbers;
}

}  // namespace

CameraModel lensIn(const fs::path& archive) {
  const std::vector<double> k = numbersOf(archive, "K.npy", 9);
  if (k.size() != 9) throw std::runtime_error(archive.string() + "/K.npy: expected 3 x 3 numbers");
  return radtanLens(archive, {k[0], k[4], k[2], k[5]}, numbersOf(archive, "D.npy", 5));
}

std::unique_ptr<EventStream> openArrayEvents(EventTable table, const ReaderOptions& options) {
  const auto array_of = [](const RowColumn& column) -> const NpyArray& {
    return static_cast<const NpyArray&>(*column.rows);
  };
  const NpyArray& times = array_of(table.column('t'));
  table.name = table.times = times.name();
  for (const RowColumn& column : table.columns) {
    const NpyArray& array = array_of(column);
    if (array.size() == times.size()) continue;
    throw std::runtime_error(fmt::format("{}: {} rows: expected {}, as {} has", array.name(),
                                         array.size(), times.size(), times.name()));
  }
  table.seek_margin_ns = kMaxEventDelayNs;
  return eventsOf(std::move(table), options);
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
    return looksLikeNpy(firstContentOf(file, 8));
  } catch (const std::exception&) {
    return false;
  }
}

RecordingParts openEventArrays(const std::vector<fs::path>& files, const ReaderOptions& options) {
  RecordingParts parts;
  for (const fs::path& file : files) {
    EventTable table = eventColumnsOf(file, options);
    if (!options.time_unit.empty()) table.time_unit_ns.reset();  // as for text
    parts.cameras.push_back(openArrayEvents(std::move(table), options));
  }
  if (files.size() == 1 && beginsWith(files.front(), "PK")) {
    const std::vector<std::string> members = membersOf(files.front());
    const auto has = [&](const char* name) {
      return std::find(members.begin(), members.end(), name) != members.end();
    };
    if (has("K.npy") && has("D.npy")) {
      parts.calibration = Calibration{files.front(), {{{lensIn(files.front()), {}, 0}}}};
    }
  }
  return parts;
}

}  // namespace efm
