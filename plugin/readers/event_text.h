// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "plugin/readers/event_stream.h"

namespace efm {

/// Events from text with a line `t x y p` per event: decimal seconds (exact), pixel, polarity 0 or
/// 1. Blank lines, text after a `#`, repeated blanks, tabs and CRLF are ignored.
class EventTextStream : public EventStream {
 public:
  /// @throws std::runtime_error if the file cannot be opened.
  explicit EventTextStream(std::filesystem::path file);

  bool read(std::vector<Event>& events) override;
  std::string positionOf(std::size_t index) const override;
  std::string name() const override { return file_.string(); }
  double progress() const override;

 private:
  void takeLines(const char* begin, const char* end, std::vector<Event>& events);
  void takeLine(std::string_view line, bool unterminated, std::vector<Event>& events);
  const char* parsePlainLine(const char* text, Event& event) const;
  std::optional<Event> parseLine(std::string_view line, bool unterminated) const;
  std::string place() const;

  std::filesystem::path file_;
  std::ifstream stream_;
  std::uint64_t bytes_total_ = 0;
  std::uint64_t bytes_read_ = 0;
  bool ended_ = false;

  std::vector<char> block_;  // text
  std::size_t carried_ = 0;  // bytes of an incomplete line at its beginning
  std::uint64_t line_ = 0;   // number of the current line
  /// The line of an event of the last block, where it is not the line after that of the event
  /// before.
  std::vector<std::pair<std::size_t, std::uint64_t>> lines_;
};

}  // namespace efm
