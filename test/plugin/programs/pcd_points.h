// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <stdexcept>
#include <string>

namespace efm {

inline pcl::PointCloud<pcl::PointXYZI> pointsOfPcd(const std::string& file) {
  pcl::PointCloud<pcl::PointXYZI> cloud;
  if (pcl::io::loadPCDFile(file, cloud) != 0) throw std::runtime_error("cannot read " + file);
  return cloud;
}

}  // namespace efm
