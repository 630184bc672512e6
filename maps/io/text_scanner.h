// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace efm {

/// A file's bytes, read from front to back, that can say where something is wrong.
class TextScanner {
 public:
  explicit TextScanner(std::string_view bytes) : bytes_(bytes), rest_(bytes) {}

  /// The next line, without its end ("\n" or "\r\n").
  /// @param expected what it should hold: for the error.
  /// @throws std::runtime_error where the file ends first. A last line that no line break ends is
  /// such an end too: part of it may be missing, and half a number is a number.
  std::string_view line(std::string_view expected);
  /// The next bytes, at most as many as there are.
  std::string_view take(std::size_t bytes);

  std::size_t left() const { return rest_.size(); }
  /// The number of the line that was read last, counted from 1.
  std::size_t lineNumber() const { return lines_; }

  /// @throws std::runtime_error naming the byte that comes next, counted from 0.
  [[noreturn]] void refuse(const std::string& why) const;
  /// @throws std::runtime_error where more than blanks are left.
  void expectEnd() const;

 private:
  std::string_view bytes_;
  std::string_view rest_;
  std::size_t lines_ = 0;
};

/// A line and what blanks separate in it.
struct WordLine {
  std::size_t number = 0;  ///< Counted from 1.
  std::vector<std::string_view> words;

  /// @throws std::runtime_error naming the line.
  [[noreturn]] void refuse(const std::string& why) const;
  /// The word as a whole number from 0 on.
  /// @throws std::runtime_error naming the line where there is no such word or it is no number.
  std::uint64_t count(std::size_t word) const;
};

/// The next line of the file, as `TextScanner::line` has it.
WordLine wordLine(TextScanner& cursor, std::string_view expected);

}  // namespace efm
