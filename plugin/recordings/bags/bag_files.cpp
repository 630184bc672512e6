// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/bags/bag_files.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "plugin/recordings/streams/source_files.h"
#ifdef EFM_WITH_ROSBAG
#include "plugin/recordings/bags/ros1_bag.h"
#endif
#ifdef EFM_WITH_ROS2
#include "plugin/recordings/bags/mcap_bag.h"
#include "plugin/recordings/bags/ros2_db3.h"
#endif

namespace efm {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kRos1Start = "#ROSBAG V";
constexpr std::string_view kDb3Start("SQLite format 3\0", 16);
constexpr std::string_view kMcapStart("\x89MCAP0\r\n", 8);
constexpr std::string_view kZstdStart = "\x28\xb5\x2f\xfd";
constexpr const char* kMetadata = "metadata.yaml";

/// "recording.db3.zstd"
bool isCompressedBag(const fs::path& file) {
  const fs::path inner = file.stem().extension();
  return (inner == ".db3" || inner == ".mcap") && beginsWith(file, kZstdStart);
}

[[noreturn]] void refuseCompressed(const fs::path& file) {
  throw std::runtime_error(fmt::format(
      "{}: a compressed bag: expected an uncompressed one, by `zstd -d` (files) or `ros2 bag "
      "convert` (messages)",
      file.string()));
}

std::shared_ptr<BagSource> openBagFile(const fs::path& file) {
  if (isCompressedBag(file)) refuseCompressed(file);
  const bool ros1 = isRos1Bag(file);
#ifdef EFM_WITH_ROSBAG
  if (ros1) return openRos1Bag(file);
#endif
#ifdef EFM_WITH_ROS2
  if (beginsWith(file, kDb3Start)) return openDb3(file);
  if (beginsWith(file, kMcapStart)) return openMcap(file);
#endif
  if (ros1 || isRos2Bag(file)) {
    throw std::runtime_error(fmt::format("{}: this build does not read bags of ROS {} ({})",
                                         file.string(), ros1 ? 1 : 2,
                                         ros1 ? "EFM_READ_ROSBAG" : "EFM_READ_ROS2"));
  }
  if (!isFile(file)) throw std::runtime_error(file.string() + ": no such file: expected a bag");
  throw std::runtime_error(file.string() +
                           ": not a bag: expected one of ROS 1 (.bag) or ROS 2 (.db3, .mcap)");
}

/// The files that metadata.yaml lists, relative to its folder.
std::vector<fs::path> filesOfMetadata(const fs::path& metadata) {
  std::vector<fs::path> files;
  std::string compression;
  try {
    const YAML::Node root = YAML::LoadFile(metadata.string())["rosbag2_bagfile_information"];
    if (root["compression_mode"]) compression = root["compression_mode"].as<std::string>();
    for (const YAML::Node& file : root["relative_file_paths"]) {
      // Older bags have the folder's name in front.
      files.push_back(metadata.parent_path() / fs::path(file.as<std::string>()).filename());
    }
  } catch (const YAML::Exception& error) {
    throw std::runtime_error(fmt::format("{}: {}: expected the metadata of a ROS 2 bag",
                                         metadata.string(), error.what()));
  }
  if (!compression.empty() && compression != "NONE") refuseCompressed(metadata);
  if (files.empty()) {
    throw std::runtime_error(
        fmt::format("{}: relative_file_paths is missing or empty: expected the bag's files",
                    metadata.string()));
  }
  return files;
}

}  // namespace

bool isRos1Bag(const fs::path& file) { return beginsWith(file, kRos1Start); }

bool isRos2Bag(const fs::path& source) {
  if (isFile(source / kMetadata)) {
    std::ifstream stream(source / kMetadata);
    std::string line;
    return std::getline(stream, line) && line.rfind("rosbag2_bagfile_information", 0) == 0;
  }
  return beginsWith(source, kDb3Start) || beginsWith(source, kMcapStart) || isCompressedBag(source);
}

std::vector<std::shared_ptr<BagSource>> openBagFiles(const fs::path& source) {
  std::vector<std::shared_ptr<BagSource>> bags;
  if (!isFile(source / kMetadata)) {
    bags.push_back(openBagFile(source));
    return bags;
  }
  for (const fs::path& file : filesOfMetadata(source / kMetadata)) {
    bags.push_back(openBagFile(file));
  }
  return bags;
}

}  // namespace efm
