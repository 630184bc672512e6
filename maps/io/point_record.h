// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "mapping/base/number_bytes.h"
#include "maps/io/point_cloud_file.h"

namespace efm {

/// Reads the bytes of a file from front to back. Its errors name the line or the byte.
class TextScanner {
 public:
  explicit TextScanner(std::string_view bytes) : bytes_(bytes), rest_(bytes) {}

  /// The next line, without its end ("\n" or "\r\n").
  /// @param expected the content of the line, for the error message.
  /// @throws std::runtime_error where the file ends before the line does. A last line without a
  /// line break may be cut short.
  std::string_view line(std::string_view expected);
  /// The next bytes: this number of them, or all that are left.
  std::string_view take(std::size_t bytes);

  /// Number of bytes that are left.
  std::size_t left() const { return rest_.size(); }
  /// The number of the last line that was read, counted from 1.
  std::size_t lineNumber() const { return lines_; }

  /// @throws std::runtime_error naming the next byte, counted from 0.
  [[noreturn]] void refuse(const std::string& why) const;
  /// @throws std::runtime_error where anything but white space is left.
  void expectEnd() const;

 private:
  std::string_view bytes_;
  std::string_view rest_;
  std::size_t lines_ = 0;
};

/// A line, split at blanks.
struct WordLine {
  std::size_t number = 0;  ///< Counted from 1.
  std::vector<std::string_view> words;

  /// @throws std::runtime_error naming the line.
  [[noreturn]] void refuse(const std::string& why) const;
  /// The word with this index as a whole number from 0 on.
  std::uint64_t count(std::size_t word) const;
};

/// The words of `TextScanner::line`.
WordLine wordLine(TextScanner& scanner, std::string_view expected);

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
PointCloudContent readTextRecords(TextScanner& scanner, const std::vector<RecordField>& fields,
                                  std::uint64_t count);
PointCloudContent readBinaryRecords(TextScanner& scanner, const std::vector<RecordField>& fields,
                                    std::uint64_t count, const RecordOrder& order);

}  // namespace efm
