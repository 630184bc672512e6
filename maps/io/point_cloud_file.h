// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "maps/cloud/cloud_point.h"

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

struct PointCloudContent {
  std::vector<CloudPoint> points;  ///< In the order of the file.
  std::uint64_t non_finite = 0;    ///< Left out: a coordinate is not finite, as sensors mark gaps.
};

/// Reads a PCD file (ascii, binary, binary_compressed) or a PLY file (ascii, binary of either
/// order), as the path's extension says: the fields x, y, z and, where there is one, intensity, of
/// any numeric type, doubles in full. Confidence is the intensity as it stands, or 1; support is 1.
/// Other fields, elements and a PCD's viewpoint are ignored.
/// @throws std::runtime_error naming the path, the line or byte, the value and what was expected
/// there, wherever the file is not all that its header promises.
PointCloudContent readPointCloud(const std::filesystem::path& path);

}  // namespace efm
