// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "maps/io/point_cloud_file.h"
#include "maps/io/text_scanner.h"

namespace efm {

/// The number types of PCD and PLY files.
enum class NumberType {
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat32,
  kFloat64,
};

std::size_t sizeOf(NumberType type);

/// Reads one number from its bytes.
/// @param at `sizeOf(type)` bytes.
double numberAt(const char* at, NumberType type, bool big_endian);

/// One field of a point in a file: `count` numbers of one type.
struct RecordField {
  std::string name;
  NumberType type = NumberType::kFloat32;
  std::size_t count = 1;
};

/// The order of the bytes of points.
struct RecordOrder {
  bool big_endian = false;
  bool by_field = false;  ///< The first field of all points, then the next; else point by point.
};

/// Bytes of one point.
std::size_t bytesOf(const std::vector<RecordField>& fields);

/// Reads `count` points: lines of numbers, blank lines aside, or records of `bytesOf(fields)`
/// bytes. The rest of the file is left to the caller.
/// @throws std::runtime_error naming the line or byte where a point is malformed or the file ends,
/// or where a field x, y or z is missing, is there twice, or has more than one number.
PointCloudContent readTextRecords(TextScanner& scanner, const std::vector<RecordField>& fields,
                                  std::uint64_t count);
PointCloudContent readBinaryRecords(TextScanner& scanner, const std::vector<RecordField>& fields,
                                    std::uint64_t count, const RecordOrder& order);

}  // namespace efm
