// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "maps/cloud_point.h"

namespace efm {

enum class PointCloudEncoding {
  kBinary,      ///< Little endian.
  kAscii,       ///< As few digits as read back to the same float.
  kCompressed,  ///< PCD alone: binary_compressed (LZF).
};

/// Writes a point cloud: a PCD or a PLY file, as the path's extension says, with the fields x y z
/// intensity (intensity = confidence), all float32. No points are a valid file. Appears under its
/// name only when it is complete.
/// @throws std::runtime_error naming the path where it cannot be written, the format does not have
/// the encoding, or a float cannot hold a point.
void writePointCloud(const std::filesystem::path& path, const std::vector<CloudPoint>& points,
                     PointCloudEncoding encoding = PointCloudEncoding::kBinary);

/// As `writePointCloud`, a PCD file whatever the path's extension.
void writePcd(const std::filesystem::path& path, const std::vector<CloudPoint>& points,
              PointCloudEncoding encoding = PointCloudEncoding::kBinary);

}  // namespace efm
