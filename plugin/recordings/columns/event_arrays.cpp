// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/columns/event_arrays.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <map>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/files/file_content.h"
#include "plugin/recordings/streams/time_unit.h"
#include "plugin/recordings/text/event_columns.h"

namespace efm {
namespace {

namespace fs = std::filesystem;

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

std::string shapeOf(const NpyHeader& header) {
  std::string fields;
  for (const NpyField& field : header.fields) fields += " " + field.name;
  return fmt::format("({}){}{}", fmt::join(header.shape, ", "),
                     header.structured ? " with fields" : "", fields);
}

/// The arrays of a file, and the expressions of Python that are their columns of events.
struct ArraysOfFile {
  std::string content;  ///< For errors: "t (100), x (100)".
  std::map<char, std::string> columns;

  void add(const std::string& name, const NpyHeader& header) {
    content += fmt::format("{}{}{}{}", content.empty() ? "" : ", ", name, name.empty() ? "" : " ",
                           shapeOf(header));
    const auto named = [&](const std::string& word, const std::string& value) {
      columns.emplace(eventColumnOf(headerWord(word)), value);
    };
    const std::string value = name.empty() ? "z" : fmt::format("z['{}']", name);
    for (const NpyField& field : header.fields) {
      named(field.name, fmt::format("{}['{}']", value, field.name));
    }
    const bool is_list = header.shape.size() == 1;
    if (!header.structured && is_list) named(name, value);
    if (header.shape.size() != 2) return;
    if (header.shape[1] == 2) {  // E-NeRF: position (N, 2)
      columns.insert({{'x', value + "[:, 0]"}, {'y', value + "[:, 1]"}});
    }
    for (int k = 0; header.shape[1] == 4 && k < 4; ++k) {
      columns.emplace("txyp"[k], fmt::format("{}[:, {}]", value, k));
    }
  }
};

/// Rejects other arrays, with the lines of Python that make an array that is read.
[[noreturn]] void reject(const fs::path& file, const ArraysOfFile& arrays) {
  const auto column = [&](char letter) {
    const auto found = arrays.columns.find(letter);
    return found == arrays.columns.end() ? std::string(1, letter) : found->second;
  };
  throw std::runtime_error(fmt::format(
      "{}: {}: expected a structured array with the fields x, y, p and t. Python makes one: import "
      "numpy as np, event_fusion as ef; z = np.load('{}'); np.save('events.npy', ef.events({}, {}, "
      "{}, {}, time_unit='us')), if these are the columns x, y, p, t and the unit of t (s, ms, us, "
      "ns); then read events.npy with --time-unit ns. Of poses: ef.write_poses('poses.txt', (t, "
      "T_world_rig))",
      file.string(), arrays.content.empty() ? "no arrays" : arrays.content, file.string(),
      column('x'), column('y'), column('p'), column('t')));
}

ArraysOfFile arraysOf(const fs::path& file) {
  ArraysOfFile arrays;
  if (!beginsWith(file, "PK")) {
    arrays.add("", readNpyHeader(file));
    return arrays;
  }
  for (const std::string& member : membersOf(file)) {
    try {
      arrays.add(fs::path(member).stem().string(), readNpyHeader(file, member));
    } catch (const std::runtime_error&) {  // Python objects, beside the numbers
    }
  }
  return arrays;
}

EventTable eventColumnsOf(const fs::path& file) {
  if (beginsWith(file, "PK") || !readNpyHeader(file).structured) reject(file, arraysOf(file));
  const auto array = std::make_shared<NpyArray>(file);
  const std::vector<NpyField>& fields = array->header().fields;
  EventTable table;
  for (const char column : kEventColumns) {
    const auto found = std::find_if(fields.begin(), fields.end(), [&](const NpyField& field) {
      return field.name == std::string(1, column);
    });
    if (found == fields.end()) reject(file, arraysOf(file));
    const auto index = static_cast<std::size_t>(found - fields.begin());
    table.column(column) = NpyArray::columnOf(array, index);
  }
  if (isMetavision(fields)) table.time_unit_ns = kNanosecondsPerMicrosecond;
  return table;
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

std::string arraysIn(const fs::path& file) { return arraysOf(file).content; }

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
    EventTable table = eventColumnsOf(file);
    if (!options.time_unit.empty()) table.time_unit_ns.reset();  // as for text
    parts.cameras.push_back(openArrayEvents(std::move(table), options));
  }
  return parts;
}

}  // namespace efm
