// SPDX-License-Identifier: BSD-3-Clause
#include "maps/io/point_cloud_file.h"

#include <algorithm>
#include <cassert>
#include <cctype>
#include <cmath>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>

#include "mapping/base/atomic_file.h"
#include "mapping/base/number_bytes.h"
#include "mapping/base/text.h"
#include "maps/io/point_record.h"

namespace efm {

void writePcd(const std::filesystem::path& path, const MapCloud& cloud) {
  writeAtomically(path, [&](const std::filesystem::path& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    writePcdTo(file, cloud);
    file.close();
    if (!file) throw std::runtime_error("the file cannot be created or the disk is full");
  });
}

PointCloudContent readPointCloud(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  try {
    if (extension == ".pcd") return parsePcd(readBytes(path));
    if (extension == ".ply") return parsePly(readBytes(path));
    throw std::runtime_error("extension " + inQuotes(extension) + ": expected .pcd or .ply");
  } catch (const std::exception& error) {
    throw std::runtime_error("cannot read " + path.string() + ": " + error.what());
  }
}

namespace {

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<RecordField> fields;
  std::size_t list_line = 0;  ///< Number of the line with a list property; 0: none.
};

struct PlyHeader {
  std::string format;
  std::vector<PlyElement> elements;
};

NumberType numberType(const WordLine& line, std::string_view name) {
  static const std::map<std::string_view, NumberType> known = {
      {"char", NumberType::kInt8},      {"int8", NumberType::kInt8},
      {"uchar", NumberType::kUint8},    {"uint8", NumberType::kUint8},
      {"short", NumberType::kInt16},    {"int16", NumberType::kInt16},
      {"ushort", NumberType::kUint16},  {"uint16", NumberType::kUint16},
      {"int", NumberType::kInt32},      {"int32", NumberType::kInt32},
      {"uint", NumberType::kUint32},    {"uint32", NumberType::kUint32},
      {"float", NumberType::kFloat32},  {"float32", NumberType::kFloat32},
      {"double", NumberType::kFloat64}, {"float64", NumberType::kFloat64},
  };
  const auto type = known.find(name);
  if (type == known.end()) {
    line.reject("type " + inQuotes(name) +
                ": expected char, uchar, short, ushort, int, uint, float, double or the same with "
                "their bits (int8 to float64)");
  }
  return type->second;
}

std::string readFormat(const WordLine& line) {
  const bool known = line.words.size() == 3 && line.words[0] == "format" &&
                     (line.words[1] == "ascii" || line.words[1] == "binary_little_endian" ||
                      line.words[1] == "binary_big_endian") &&
                     line.words[2] == "1.0";
  if (!known) {
    line.reject(
        "not a known format: expected format ascii 1.0, format binary_little_endian 1.0 or "
        "format binary_big_endian 1.0");
  }
  return std::string(line.words[1]);
}

void readProperty(const WordLine& line, std::vector<PlyElement>& elements) {
  if (elements.empty()) line.reject("a property: expected an element before it");
  PlyElement& element = elements.back();
  if (line.words.size() == 5 && line.words[1] == "list") {
    element.list_line = line.number;
    return;
  }
  if (line.words.size() != 3) {
    line.reject("expected property TYPE NAME or property list TYPE TYPE NAME");
  }
  element.fields.push_back({std::string(line.words[2]), numberType(line, line.words[1]), 1});
}

PlyHeader readHeader(TextScanner& scanner) {
  if (scanner.line("ply, as the first line of a PLY file") != "ply") {
    WordLine{1, {}}.reject("not a PLY file: expected ply");
  }
  PlyHeader header;
  while (true) {
    const WordLine line = wordLine(scanner, "a line of a PLY header, up to end_header");
    const std::string_view key = line.words.empty() ? std::string_view{} : line.words[0];
    if (key == "comment" || key == "obj_info") continue;
    if (header.format.empty()) {
      header.format = readFormat(line);
    } else if (key == "element") {
      if (line.words.size() != 3) line.reject("expected element NAME COUNT");
      header.elements.push_back({std::string(line.words[1]), line.count(2), {}, 0});
    } else if (key == "property") {
      readProperty(line, header.elements);
    } else if (key == "end_header") {
      return header;
    } else {
      line.reject(inQuotes(key) + ": expected comment, obj_info, element, property or end_header");
    }
  }
}

/// Skips an element before the vertices.
void skip(TextScanner& scanner, const PlyElement& element, bool is_text) {
  if (is_text) {
    for (std::uint64_t i = 0; i < element.count; ++i) scanner.line("an element " + element.name);
    return;
  }
  if (element.list_line != 0 && element.count != 0) {
    WordLine{element.list_line, {}}.reject("a list in element " + printable(element.name) +
                                           ": expected lists behind element vertex alone");
  }
  const std::size_t bytes = bytesOf(element.fields);
  if (bytes == 0) return;
  if (scanner.left() / bytes < element.count) {
    scanner.reject(std::to_string(scanner.left()) + " bytes are left: expected " +
                   std::to_string(element.count) + " elements " + printable(element.name) + " of " +
                   std::to_string(bytes) + " bytes: is the file cut short?");
  }
  scanner.take(static_cast<std::size_t>(element.count) * bytes);
}

}  // namespace

void writePlyTo(std::ostream& stream, const MapCloud& cloud,
                const std::vector<PointColour>& colours, const std::vector<StampedPose>& views) {
  assert(colours.size() == cloud.size());
  NumberText header;
  header << "ply\nformat binary_little_endian 1.0\nelement vertex " << cloud.size()
         << "\nproperty double x\nproperty double y\nproperty double z\n";
  if (!views.empty()) header << "property float nx\nproperty float ny\nproperty float nz\n";
  header << "property uchar red\nproperty uchar green\nproperty uchar blue\n"
            "property float confidence\nproperty uint support\nproperty float probability\n"
            "end_header\n";
  stream << header.str();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const MapPoint& point = cloud[i];
    const Eigen::Vector3d p_world = positionIn(cloud, point);
    if (!p_world.allFinite() || !std::isfinite(point.intensity)) {
      throw std::runtime_error("point " + std::to_string(i) + " " +
                               pointText({p_world, point.intensity}) + ": expected finite numbers");
    }
    for (const double value : p_world) writeLittleEndian(stream, value);
    if (!views.empty()) {
      const std::size_t view = std::min<std::size_t>(point.first_keyframe, views.size() - 1);
      const Eigen::Vector3f normal =
          (views[view].T_world_rig.translation - p_world).normalized().cast<float>();
      for (const float value : normal) writeLittleEndian(stream, value);
    }
    for (const std::uint8_t value : colours[i]) writeLittleEndian(stream, value);
    writeLittleEndian(stream, point.intensity);
    writeLittleEndian(stream, point.support);
    writeLittleEndian(stream, point.probability);
  }
}

PointCloudContent parsePly(std::string_view bytes) {
  TextScanner scanner(bytes);
  const PlyHeader header = readHeader(scanner);
  const WordLine end_of_header{scanner.lineNumber(), {}};
  const bool is_text = header.format == "ascii";
  const auto vertex =
      std::find_if(header.elements.begin(), header.elements.end(),
                   [](const PlyElement& element) { return element.name == "vertex"; });
  if (vertex == header.elements.end()) {
    end_of_header.reject("end_header without an element vertex: expected one before");
  }
  if (vertex->list_line != 0) {
    WordLine{vertex->list_line, {}}.reject("a list in element vertex: expected single numbers");
  }
  for (auto before = header.elements.begin(); before != vertex; ++before) {
    skip(scanner, *before, is_text);
  }
  PointCloudContent content =
      is_text ? readTextRecords(scanner, vertex->fields, vertex->count)
              : readBinaryRecords(scanner, vertex->fields, vertex->count,
                                  {header.format == "binary_big_endian", false});
  const bool is_last = std::all_of(vertex + 1, header.elements.end(),
                                   [](const PlyElement& element) { return element.count == 0; });
  if (is_last) scanner.expectEnd();
  return content;
}

}  // namespace efm
