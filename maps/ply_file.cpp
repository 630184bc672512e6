// SPDX-License-Identifier: BSD-3-Clause
#include "maps/ply_file.h"

#include <stdexcept>

#include "maps/point_row.h"

namespace efm {
void writePlyTo(std::ostream& stream, const std::vector<CloudPoint>& points,
                PointCloudEncoding encoding) {
  if (encoding == PointCloudEncoding::kCompressed) {
    throw std::runtime_error("compressed PLY: expected binary or ASCII, PLY knows no other");
  }
  const bool is_text = encoding == PointCloudEncoding::kAscii;
  const std::vector<PointRow> rows = pointRows(points);
  stream << "ply\nformat " << (is_text ? "ascii" : "binary_little_endian")
         << " 1.0\nelement vertex " << rows.size()
         << "\nproperty float x\nproperty float y\nproperty float z\nproperty float intensity\n"
            "end_header\n";
  if (is_text) return writeText(stream, rows);
  for (const PointRow& row : rows) {
    for (const float value : row) writeBinary(stream, value);
  }
}

}  // namespace efm
