// SPDX-License-Identifier: BSD-3-Clause
#include "maps/pcd_file.h"

#include <pcl/io/lzf.h>

#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "maps/point_row.h"

namespace efm {
namespace {

std::string_view nameInFile(PointCloudEncoding encoding) {
  if (encoding == PointCloudEncoding::kAscii) return "ascii";
  return encoding == PointCloudEncoding::kBinary ? "binary" : "binary_compressed";
}

void writeNumber(std::ostream& stream, std::uint32_t value) {
  for (unsigned shift = 0; shift < 32; shift += 8) {
    stream.put(static_cast<char>(value >> shift & 0xFFU));
  }
}

/// All x, then all y, z and intensities: neighbours resemble each other.
void writeCompressed(std::ostream& stream, const std::vector<PointRow>& rows) {
  std::ostringstream by_field;
  for (std::size_t field = 0; field < PointRow().size(); ++field) {
    for (const PointRow& row : rows) writeBinary(by_field, row[field]);
  }
  const std::string plain = by_field.str();
  std::string packed(plain.size() + plain.size() / 16 + 64, '\0');  // LZF's worst: 4 % more
  if (packed.size() > std::numeric_limits<std::uint32_t>::max()) {
    throw std::runtime_error(std::to_string(rows.size()) +
                             " points: expected fewer, a compressed file has 32-bit sizes");
  }
  unsigned int packed_bytes = 0;
  if (!plain.empty()) {
    packed_bytes = pcl::lzfCompress(plain.data(), static_cast<unsigned int>(plain.size()),
                                    packed.data(), static_cast<unsigned int>(packed.size()));
    if (packed_bytes == 0) throw std::runtime_error("the points cannot be compressed");
  }
  writeNumber(stream, packed_bytes);
  writeNumber(stream, static_cast<std::uint32_t>(plain.size()));
  stream.write(packed.data(), static_cast<std::streamsize>(packed_bytes));
}

}  // namespace

void writePcdTo(std::ostream& stream, const std::vector<CloudPoint>& points,
                PointCloudEncoding encoding) {
  const std::vector<PointRow> rows = pointRows(points);
  stream << "# .PCD v0.7 - Point Cloud Data file format\n"
            "VERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n"
            "WIDTH "
         << rows.size() << "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " << rows.size()
         << "\nDATA " << nameInFile(encoding) << '\n';
  if (encoding == PointCloudEncoding::kAscii) return writeText(stream, rows);
  if (encoding == PointCloudEncoding::kCompressed) return writeCompressed(stream, rows);
  for (const PointRow& row : rows) {
    for (const float value : row) writeBinary(stream, value);
  }
}

}  // namespace efm
