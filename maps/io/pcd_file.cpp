// SPDX-License-Identifier: BSD-3-Clause
#include "maps/io/point_cloud_file.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>

#include "mapping/base/number_bytes.h"
#include "mapping/base/text.h"
#include "maps/io/point_record.h"

namespace efm {
namespace {

/// The lines of a header by their keys.
using HeaderLines = std::map<std::string, WordLine, std::less<>>;

HeaderLines readHeaderLines(TextScanner& scanner) {
  constexpr std::string_view kKeys =
      " VERSION FIELDS SIZE TYPE COUNT WIDTH HEIGHT VIEWPOINT POINTS DATA ";
  HeaderLines lines;
  while (lines.count("DATA") == 0) {
    const WordLine line = wordLine(scanner, "a line of a PCD header, up to DATA");
    if (line.words.empty() || line.words[0].front() == '#') continue;
    const std::string key(line.words[0] == "COLUMNS" ? "FIELDS" : line.words[0]);
    if (kKeys.find(" " + key + " ") == std::string_view::npos) {
      line.reject(inQuotes(key) + ": expected one of" + std::string(kKeys) + "(a PCD header)");
    }
    if (!lines.emplace(key, line).second) line.reject(key + " again: expected it once");
  }
  for (const char* key : {"FIELDS", "SIZE", "TYPE", "POINTS"}) {
    if (lines.count(key) != 0) continue;
    lines.at("DATA").reject("DATA ends the header: expected " + std::string(key) + " before it");
  }
  return lines;
}

NumberType numberType(const WordLine& types, const WordLine& sizes, std::size_t word) {
  const std::string_view kind = types.words[word];
  const std::string_view size = sizes.words[word];
  std::optional<NumberType> type;
  if (kind.size() == 1 && size.size() == 1) {
    type = numberTypeOf(static_cast<char>(kind[0] - 'A' + 'a'),
                        static_cast<std::size_t>(size[0] - '0'));
  }
  if (!type) {
    types.reject("TYPE " + inQuotes(kind) + " of SIZE " + inQuotes(size) +
                 ": expected I or U of 1, 2, 4 or 8 bytes, or F of 4 or 8");
  }
  return *type;
}

std::vector<RecordField> fieldsOf(const HeaderLines& lines) {
  constexpr std::uint64_t kMaxCount = 1U << 20U;
  const std::size_t words = lines.at("FIELDS").words.size();
  for (const char* key : {"SIZE", "TYPE", "COUNT"}) {
    const auto line = lines.find(key);
    if (line == lines.end() || line->second.words.size() == words) continue;
    line->second.reject(std::to_string(line->second.words.size() - 1) + " values: expected " +
                        std::to_string(words - 1) + ", as many as FIELDS has");
  }
  const auto counts = lines.find("COUNT");

  std::vector<RecordField> fields;
  for (std::size_t word = 1; word < words; ++word) {
    const std::uint64_t count = counts == lines.end() ? 1 : counts->second.count(word);
    if (count < 1 || count > kMaxCount) {
      counts->second.reject("COUNT " + std::to_string(count) + ": expected 1 to " +
                            std::to_string(kMaxCount));
    }
    fields.push_back({std::string(lines.at("FIELDS").words[word]),
                      numberType(lines.at("TYPE"), lines.at("SIZE"), word),
                      static_cast<std::size_t>(count)});
  }
  return fields;
}

std::uint64_t numberOfPoints(const HeaderLines& lines) {
  const WordLine& line = lines.at("POINTS");
  const std::uint64_t points = line.count(1);
  const auto width_line = lines.find("WIDTH");
  const auto height_line = lines.find("HEIGHT");
  if (width_line == lines.end() || height_line == lines.end()) return points;
  const std::uint64_t width = width_line->second.count(1);
  const std::uint64_t height = height_line->second.count(1);
  const bool agree =
      width == 0 || height == 0 ? points == 0 : points % width == 0 && points / width == height;
  if (!agree) {
    line.reject("POINTS " + std::to_string(points) + ": expected WIDTH x HEIGHT, " +
                std::to_string(width) + " x " + std::to_string(height));
  }
  return points;
}

/// Returns the origin of the points. In a cloud with the fields of MapPoint, VIEWPOINT is this
/// origin. Elsewhere it is a sensor's position, and points may be relative to anything.
Eigen::Vector3d originOf(const HeaderLines& lines, const std::vector<RecordField>& fields) {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  const auto has = [&](const char* name) {
    return std::any_of(fields.begin(), fields.end(),
                       [name](const RecordField& field) { return field.name == name; });
  };
  const auto viewpoint = lines.find("VIEWPOINT");
  if (viewpoint == lines.end() || !has("support") || !has("sigma")) return origin;
  const WordLine& line = viewpoint->second;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto number =
        axis + 1 < line.words.size() ? parseFinite(line.words[axis + 1]) : std::nullopt;
    if (!number) line.reject("VIEWPOINT: expected 7 numbers, the origin of the points first");
    origin[static_cast<Eigen::Index>(axis)] = *number;
  }
  return origin;
}

}  // namespace

void writePcdTo(std::ostream& stream, const MapCloud& cloud) {
  writePcdHeader(stream, cloud.size(), cloud.sensor_origin_.head<3>());
  writePcdPoints(stream, cloud);
}

void writePcdHeader(std::ostream& stream, std::uint64_t points, const Eigen::Vector3f& origin) {
  NumberText header;
  header << "# .PCD v0.7 - Point Cloud Data file format\n"
            "VERSION 0.7\nFIELDS x y z intensity support sigma probability\n"
            "SIZE 4 4 4 4 4 4 4\n"
            "TYPE F F F F U F F\nCOUNT 1 1 1 1 1 1 1\nWIDTH "
         << points << "\nHEIGHT 1\nVIEWPOINT " << origin.x() << " " << origin.y() << " "
         << origin.z() << " 1 0 0 0\nPOINTS " << points << "\nDATA binary\n";
  stream << header.str();
}

void writePcdPoints(std::ostream& stream, const MapCloud& cloud) {
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const MapPoint& point = cloud[i];
    if (!point.getVector3fMap().allFinite() || !std::isfinite(point.intensity)) {
      throw std::runtime_error("point " + std::to_string(i) + " " +
                               pointText({positionIn(cloud, point), point.intensity}) +
                               ": expected finite numbers within a float's range");
    }
    for (const float value : point.getVector3fMap()) writeLittleEndian(stream, value);
    writeLittleEndian(stream, point.intensity);
    writeLittleEndian(stream, point.support);
    writeLittleEndian(stream, point.sigma);
    writeLittleEndian(stream, point.probability);
  }
}

PointCloudContent parsePcd(std::string_view bytes) {
  TextScanner scanner(bytes);
  const HeaderLines lines = readHeaderLines(scanner);
  const std::vector<RecordField> fields = fieldsOf(lines);
  const std::uint64_t points = numberOfPoints(lines);
  const WordLine& data = lines.at("DATA");
  const std::string_view encoding = data.words.size() == 2 ? data.words[1] : std::string_view{};

  if (encoding != "binary") {
    data.reject("DATA " + inQuotes(encoding) +
                ": expected binary; pcl_convert_pcd_ascii_binary FILE NEW.pcd 1 converts the file "
                "(Debian: pcl-tools)");
  }
  PointCloudContent content = readRecords(scanner, fields, points);
  scanner.expectEnd();
  const Eigen::Vector3d origin = originOf(lines, fields);
  for (CloudPoint& point : content.points) point.p_world += origin;
  return content;
}

}  // namespace efm
