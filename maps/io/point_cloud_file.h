// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <ostream>
#include <string_view>
#include <vector>

#include "mapping/geometry/trajectory.h"
#include "maps/cloud/cloud_points.h"
#include "maps/cloud/map_point.h"

namespace efm {

/// Writes a binary PCD file, whatever the extension of the path. Its fields are those of MapPoint.
/// Its VIEWPOINT is the cloud's `sensor_origin_`, which `readPointCloud` adds to the points. An
/// empty cloud makes a valid file. The file appears when it is complete (AtomicFile).
void writePcd(const std::filesystem::path& path, const MapCloud& cloud);

/// Red, green and blue.
using PointColour = std::array<std::uint8_t, 3>;

struct PointCloudContent {
  std::vector<CloudPoint> points;  ///< The points, in the order of the file.
  std::uint64_t non_finite = 0;    ///< Number of points left out: a coordinate is not finite.
};

/// Reads a binary PCD file, or a binary little-endian PLY file whose first element is the vertices;
/// the error for another encoding names the command that converts it. The extension of the path
/// selects the format. The fields x, y, z and the optional intensity may have any numeric type.
/// Doubles keep all their digits. The confidence is the intensity, or 1 without one; the support is
/// 1. Other fields, other elements and the viewpoint of a PCD file are ignored.
PointCloudContent readPointCloud(const std::filesystem::path& path);

/// Writes a binary PCD file, version 0.7.
void writePcdTo(std::ostream& stream, const MapCloud& cloud);
/// The parts of the same, for a cloud that comes in parts of one origin.
void writePcdHeader(std::ostream& stream, std::uint64_t points, const Eigen::Vector3f& origin);
void writePcdPoints(std::ostream& stream, const MapCloud& part);

/// @throws std::runtime_error naming the line or byte, the value and the expected value.
PointCloudContent parsePcd(std::string_view bytes);

/// Writes a binary little-endian file of the Stanford polygon format, version 1.0, for viewers. Per
/// vertex: x, y, z (double: maps may lie far from the origin), nx, ny, nz (float), red, green, blue
/// (uchar), confidence (float) and support (uint).
/// @param colours one per point.
/// @param views the keyframes of the cloud: normals point to the first one that saw the point.
/// Empty: no normals.
void writePlyTo(std::ostream& stream, const MapCloud& cloud,
                const std::vector<PointColour>& colours,
                const std::vector<StampedPose>& views = {});

/// Parses a binary little-endian file of the Stanford polygon format, version 1.0.
PointCloudContent parsePly(std::string_view bytes);

}  // namespace efm
