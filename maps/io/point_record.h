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

  /// Takes the next line, without its end ("\n" or "\r\n").
  /// @param expected the content of the line, for the error message.
  /// @throws std::runtime_error if the file ends before the line: a last line without a line break
  /// may be incomplete.
  std::string_view line(std::string_view expected);
  /// Takes the next `bytes` bytes, or all bytes that are left.
  std::string_view take(std::size_t bytes);

  /// Number of bytes that are left.
  std::size_t left() const { return rest_.size(); }
  /// The number of the last line that was read, counted from 1.
  std::size_t lineNumber() const { return lines_; }

  /// @throws std::runtime_error naming the next byte, counted from 0.
  [[noreturn]] void reject(const std::string& why) const;
  /// @throws std::runtime_error if anything but white space and zeros is left.
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
  [[noreturn]] void reject(const std::string& why) const;
  /// Returns the word with this index as a whole number, 0 or more.
  std::uint64_t count(std::size_t word) const;
};

/// Takes `TextScanner::line` and splits it.
WordLine wordLine(TextScanner& scanner, std::string_view expected);

/// One field of a point in a file: `count` numbers of one type.
struct RecordField {
  std::string name;
  NumberType type = NumberType::kFloat32;
  std::size_t count = 1;
};

/// Returns the bytes of one point.
std::size_t bytesOf(const std::vector<RecordField>& fields);

/// Reads `count` points: little-endian records of `bytesOf(fields)` bytes. The rest of the file is
/// left to the caller.
PointCloudContent readRecords(TextScanner& scanner, const std::vector<RecordField>& fields,
                              std::uint64_t count);

}  // namespace efm
