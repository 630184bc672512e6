// SPDX-License-Identifier: BSD-3-Clause
#include "maps/io/point_record.h"

#include <array>
#include <optional>
#include <stdexcept>

#include "mapping/base/text.h"

namespace efm {

std::string_view TextScanner::line(std::string_view expected) {
  const std::size_t end = rest_.find('\n');
  if (end == std::string_view::npos) {
    const std::string place = "line " + std::to_string(lines_ + 1) + ": ";
    throw std::runtime_error(
        place + (rest_.empty() ? "the file ends" : inQuotes(rest_) + ", then the file ends") +
        ": expected " + std::string(expected) +
        (rest_.empty() ? "" : " and the end of the line: is the file cut short?"));
  }
  ++lines_;
  std::string_view line = take(end + 1);
  line.remove_suffix(1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

std::string_view TextScanner::take(std::size_t bytes) {
  const std::string_view taken = rest_.substr(0, bytes);
  rest_.remove_prefix(taken.size());
  return taken;
}

void TextScanner::reject(const std::string& why) const {
  throw std::runtime_error("byte " + std::to_string(bytes_.size() - rest_.size()) + ": " + why);
}

void TextScanner::expectEnd() const {
  constexpr std::string_view kPadding(" \t\r\n\0", 5);  // PCL pads binary files with zeros
  if (rest_.find_first_not_of(kPadding) == std::string_view::npos) return;
  reject(std::to_string(rest_.size()) + " more bytes: expected the end of the file");
}

void WordLine::reject(const std::string& why) const {
  throw std::runtime_error("line " + std::to_string(number) + ": " + why);
}

std::uint64_t WordLine::count(std::size_t word) const {
  const std::string_view text = word < words.size() ? words[word] : std::string_view{};
  const std::optional<std::uint64_t> count = parseNumber<std::uint64_t>(text);
  if (!count) reject(inQuotes(text) + ": expected a whole number from 0 on");
  return *count;
}

WordLine wordLine(TextScanner& scanner, std::string_view expected) {
  const std::string_view text = scanner.line(expected);
  return {scanner.lineNumber(), splitWords(text, " \t")};
}

namespace {

/// The fields of a point. The intensity is optional.
constexpr std::array<std::string_view, 4> kNames = {"x", "y", "z", "intensity"};

using Values = std::array<double, 4>;

/// The index of each of `kNames` among the fields of the file.
using FieldIndices = std::array<std::optional<std::size_t>, 4>;

FieldIndices findFields(const std::vector<RecordField>& fields) {
  FieldIndices indices;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    std::string known;
    for (std::size_t at = 0; at < fields.size(); ++at) {
      known += (known.empty() ? "" : ", ") + printable(fields[at].name);
      if (fields[at].name != kNames[i]) continue;
      const std::string called = "field " + std::string(kNames[i]);
      if (indices[i]) throw std::runtime_error(called + " is there twice: expected it once");
      if (fields[at].count != 1) {
        throw std::runtime_error(called + " has " + std::to_string(fields[at].count) +
                                 " numbers: expected 1");
      }
      indices[i] = at;
    }
    if (!indices[i] && kNames[i] != "intensity") {
      throw std::runtime_error("no field " + std::string(kNames[i]) +
                               ": expected x, y and z among the fields (" + known + ")");
    }
  }
  return indices;
}

void append(PointCloudContent& content, const Values& values) {
  const Eigen::Vector3d p_world(values[0], values[1], values[2]);
  if (p_world.allFinite()) {
    content.points.push_back({p_world, static_cast<float>(values[3])});
  } else {
    ++content.non_finite;
  }
}

}  // namespace

std::size_t bytesOf(const std::vector<RecordField>& fields) {
  std::size_t bytes = 0;
  for (const RecordField& field : fields) bytes += field.count * sizeOf(field.type);
  return bytes;
}

PointCloudContent readRecords(TextScanner& scanner, const std::vector<RecordField>& fields,
                              std::uint64_t count) {
  const FieldIndices indices = findFields(fields);
  const std::size_t record_bytes = bytesOf(fields);
  if (scanner.left() / record_bytes < count) {
    scanner.reject(std::to_string(scanner.left()) + " bytes are left: expected " +
                   std::to_string(count) + " points of " + std::to_string(record_bytes) +
                   " bytes: is the file cut short?");
  }
  const auto points = static_cast<std::size_t>(count);
  const char* bytes = scanner.take(points * record_bytes).data();

  std::array<std::optional<Column>, 4> columns;
  std::size_t before = 0;  // bytes of a point in the fields before this one
  for (std::size_t at = 0; at < fields.size(); ++at) {
    const std::size_t size = fields[at].count * sizeOf(fields[at].type);
    for (std::size_t j = 0; j < indices.size(); ++j) {
      if (indices[j] != at) continue;
      columns[j] = Column{bytes + before, record_bytes, fields[at].type, false};
    }
    before += size;
  }

  PointCloudContent content;
  content.points.reserve(points);
  for (std::size_t i = 0; i < points; ++i) {
    Values values = {0, 0, 0, 1};
    for (std::size_t j = 0; j < values.size(); ++j) {
      if (columns[j]) values[j] = columns[j]->number(i);
    }
    append(content, values);
  }
  return content;
}

}  // namespace efm
