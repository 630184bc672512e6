// SPDX-License-Identifier: BSD-3-Clause
#include "maps/io/point_cloud_file.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <stdexcept>
#include <string>

#include "mapping/options/quoted_text.h"
#include "maps/io/atomic_file.h"
#include "maps/io/pcd_file.h"
#include "maps/io/ply_file.h"

namespace efm {
namespace {

enum class Format { kPcd, kPly };

Format formatOf(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".pcd") return Format::kPcd;
  if (extension == ".ply") return Format::kPly;
  throw std::runtime_error("extension " + inQuotes(extension) + ": expected .pcd or .ply");
}

void writeFile(const std::filesystem::path& path, Format format,
               const std::vector<CloudPoint>& points, PointCloudEncoding encoding) {
  std::ofstream file(path, std::ios::binary);
  if (format == Format::kPcd) {
    writePcdTo(file, points, encoding);
  } else {
    writePlyTo(file, points, encoding);
  }
  file.close();
  if (!file) throw std::runtime_error("the file cannot be created or the disk is full");
}

}  // namespace

void writePointCloud(const std::filesystem::path& path, const std::vector<CloudPoint>& points,
                     PointCloudEncoding encoding) {
  writeAtomically(path, [&](const std::filesystem::path& temporary) {
    writeFile(temporary, formatOf(path), points, encoding);
  });
}

void writePcd(const std::filesystem::path& path, const std::vector<CloudPoint>& points,
              PointCloudEncoding encoding) {
  writeAtomically(path, [&](const std::filesystem::path& temporary) {
    writeFile(temporary, Format::kPcd, points, encoding);
  });
}

PointCloudContent readPointCloud(const std::filesystem::path& path) {
  try {
    const Format format = formatOf(path);
    const std::string bytes = readBytes(path);
    return format == Format::kPcd ? parsePcd(bytes) : parsePly(bytes);
  } catch (const std::exception& error) {
    throw std::runtime_error("cannot read " + path.string() + ": " + error.what());
  }
}

}  // namespace efm
