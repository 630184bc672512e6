// SPDX-License-Identifier: BSD-3-Clause
#include "maps/io/point_row.h"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <sstream>
#include <stdexcept>

namespace efm {
namespace {

[[noreturn]] void refusePoint(std::size_t index, const CloudPoint& point) {
  std::ostringstream message;
  message.precision(17);
  message << "point " << index << " (" << point.p_world.x() << ", " << point.p_world.y() << ", "
          << point.p_world.z() << ") with confidence " << point.confidence
          << ": expected finite numbers within a float's range";
  throw std::runtime_error(message.str());
}

}  // namespace

std::vector<PointRow> pointRows(const std::vector<CloudPoint>& points) {
  std::vector<PointRow> rows;
  rows.reserve(points.size());
  for (const CloudPoint& point : points) {
    const Eigen::Vector3f p_world = point.p_world.cast<float>();
    if (!p_world.allFinite() || !std::isfinite(point.confidence)) {
      refusePoint(rows.size(), point);
    }
    rows.push_back({p_world.x(), p_world.y(), p_world.z(), point.confidence});
  }
  return rows;
}

void writeBinary(std::ostream& stream, float value) {
  std::uint32_t bits = 0;
  static_assert(sizeof(bits) == sizeof(value));
  std::memcpy(&bits, &value, sizeof(bits));
  const std::array<char, 4> bytes = {
      static_cast<char>(bits & 0xFFU), static_cast<char>(bits >> 8U & 0xFFU),
      static_cast<char>(bits >> 16U & 0xFFU), static_cast<char>(bits >> 24U)};
  stream.write(bytes.data(), bytes.size());
}

void writeText(std::ostream& stream, const std::vector<PointRow>& rows) {
  std::array<char, 32> digits{};
  for (const PointRow& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      const char* end = std::to_chars(digits.data(), digits.data() + digits.size(), row[i]).ptr;
      stream.write(digits.data(), end - digits.data());
      stream.put(i + 1 < row.size() ? ' ' : '\n');
    }
  }
}

}  // namespace efm
