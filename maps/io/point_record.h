// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "maps/io/point_cloud_file.h"
#include "maps/io/text_scanner.h"

namespace efm {

/// The numbers that PCD and PLY files are made of.
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

/// One field of a point as a file has it: `count` numbers of one type.
struct RecordField {
  std::string name;
  NumberType type = NumberType::kFloat32;
  std::size_t count = 1;
};

/// How the bytes of points are ordered.
struct RecordOrder {
  bool big_endian = false;
  bool by_field = false;  ///< The first field of all points, then the next; else point by point.
};

/// Bytes of one point.
std::size_t bytesOf(const std::vector<RecordField>& fields);

/// The points that a header promises: `count` lines of numbers, blank lines aside, or `count` times
/// `bytesOf` bytes. What stands behind them is left to the caller.
/// @throws std::runtime_error naming the place where one is not as it should be or the file ends,
/// or where no single field is called x, y or z.
PointCloudContent readTextRecords(TextScanner& cursor, const std::vector<RecordField>& fields,
                                  std::uint64_t count);
PointCloudContent readBinaryRecords(TextScanner& cursor, const std::vector<RecordField>& fields,
                                    std::uint64_t count, const RecordOrder& order);

}  // namespace efm
