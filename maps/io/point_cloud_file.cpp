// SPDX-License-Identifier: BSD-3-Clause
#include "maps/io/point_cloud_file.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <stdexcept>
#include <string>

#include "mapping/base/atomic_file.h"
#include "mapping/base/text.h"
#include "maps/io/pcd_file.h"
#include "maps/io/ply_file.h"

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

}  // namespace efm
