// SPDX-License-Identifier: BSD-3-Clause
#include "maps/io/point_cloud_file.h"

#include <algorithm>
#include <cassert>
#include <cctype>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>

#include "mapping/base/atomic_file.h"
#include "mapping/base/number_bytes.h"
#include "mapping/base/text.h"
#include "maps/io/point_record.h"

namespace efm {

void writePcd(const std::filesystem::path& path, const MapCloud& cloud) {
  writeAtomically(path, byStream([&](std::ostream& stream) { writePcdTo(stream, cloud); }));
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

/// The command that converts other files, for errors.
constexpr const char* kConvert =
    "; pcl_ply2pcd FILE NEW.pcd converts the file to PCD (Debian: pcl-tools)";

struct PlyHeader {
  std::uint64_t vertices = 0;
  std::vector<RecordField> fields;  ///< Of a vertex.
  bool is_whole = true;             ///< False: other elements are behind the vertices.
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

void requireFormat(const WordLine& line) {
  const std::vector<std::string_view> expected = {"format", "binary_little_endian", "1.0"};
  if (line.words == expected) return;
  line.reject("expected format binary_little_endian 1.0" + std::string(kConvert));
}

RecordField propertyOf(const WordLine& line) {
  if (line.words.size() > 1 && line.words[1] == "list") {
    line.reject("a list in element vertex: expected single numbers");
  }
  if (line.words.size() != 3) line.reject("expected property TYPE NAME");
  return {std::string(line.words[2]), numberType(line, line.words[1]), 1};
}

PlyHeader readHeader(TextScanner& scanner) {
  if (scanner.line("ply, as the first line of a PLY file") != "ply") {
    WordLine{1, {}}.reject("not a PLY file: expected ply");
  }
  PlyHeader header;
  bool has_format = false;
  int elements = 0;
  while (true) {
    const WordLine line = wordLine(scanner, "a line of a PLY header, up to end_header");
    const std::string_view key = line.words.empty() ? std::string_view{} : line.words[0];
    if (key == "comment" || key == "obj_info") continue;
    if (!has_format) {
      requireFormat(line);
      has_format = true;
    } else if (key == "element") {
      if (line.words.size() != 3) line.reject("expected element NAME COUNT");
      if (elements == 0 && line.words[1] != "vertex") {
        line.reject("expected element vertex first" + std::string(kConvert));
      }
      if (elements == 0) header.vertices = line.count(2);
      if (elements > 0 && line.count(2) > 0) header.is_whole = false;
      ++elements;
    } else if (elements == 0) {
      line.reject(inQuotes(key) + ": expected element vertex COUNT");
    } else if (key == "property") {
      if (elements == 1) header.fields.push_back(propertyOf(line));
    } else if (key == "end_header") {
      return header;
    } else {
      line.reject(inQuotes(key) + ": expected comment, obj_info, element, property or end_header");
    }
  }
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
  PointCloudContent content = readRecords(scanner, header.fields, header.vertices);
  if (header.is_whole) scanner.expectEnd();
  return content;
}

}  // namespace efm
