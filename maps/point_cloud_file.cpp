// SPDX-License-Identifier: BSD-3-Clause
#include "maps/point_cloud_file.h"

#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <fstream>
#include <stdexcept>

#include "maps/whole_file.h"

namespace efm {
namespace {

pcl::PointCloud<pcl::PointXYZI> asPclCloud(const std::vector<CloudPoint>& points) {
  pcl::PointCloud<pcl::PointXYZI> cloud;
  cloud.reserve(points.size());
  for (const CloudPoint& point : points) {
    pcl::PointXYZI p;
    p.getVector3fMap() = point.p_world.cast<float>();
    p.intensity = point.confidence;
    cloud.push_back(p);
  }
  return cloud;
}

/// The writer refuses an empty cloud, but an empty map is a map.
void writeHeaderOnly(const std::filesystem::path& path,
                     const pcl::PointCloud<pcl::PointXYZI>& cloud) {
  std::ofstream file(path, std::ios::binary);
  file << pcl::PCDWriter::generateHeader(cloud) << "DATA binary\n";
  file.close();
  if (!file) throw std::runtime_error("the file cannot be created or the disk is full");
}

}  // namespace

void writePcd(const std::filesystem::path& path, const std::vector<CloudPoint>& points) {
  const pcl::PointCloud<pcl::PointXYZI> cloud = asPclCloud(points);
  writeWhole(path, [&](const std::filesystem::path& temporary) {
    if (cloud.empty()) return writeHeaderOnly(temporary, cloud);
    if (pcl::PCDWriter().writeBinary(temporary.string(), cloud) != 0) {
      throw std::runtime_error("the PCD writer failed");
    }
  });
}

}  // namespace efm
