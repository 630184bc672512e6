// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/calibration/calibration_file.h"

namespace efm {

/// The period of the grid of packets: packet k has the events of [k·10 ms, (k+1)·10 ms).
inline constexpr std::int64_t kPacketPeriodNs = 10'000'000;

/// Reads events from text with a line `t x y p` per event: decimal seconds (exact), pixel, polarity
/// 0 or 1. Blank lines, text after a `#`, repeated blanks, tabs and CRLF are ignored.
///
/// The file is read on demand: memory holds a block of text and the events of about 20 ms. A wrong
/// line is a std::runtime_error that names file, line, value and expected value. It is thrown after
/// the packets of the lines above it, and again by every further call.
class EventTextReader {
 public:
  /// @throws std::runtime_error if the file cannot be opened.
  EventTextReader(std::filesystem::path file, CameraSize size);

  /// The events of the next period of the grid with events, in time order; events of equal time in
  /// the order of the file. Empty at the end.
  /// @throws std::runtime_error at a wrong line.
  std::vector<Event> nextPacket();
  /// The first time of the next packet; nothing at the end. If the next call of `nextPacket`
  /// throws, the time of the newest event.
  /// @throws std::runtime_error at a wrong line without an event before it.
  std::optional<std::int64_t> nextTime();

  /// The number of events after a newer one.
  std::uint64_t sortedEvents() const { return sorted_events_; }
  std::uint64_t bytesRead() const { return bytes_read_; }
  std::uint64_t bytesTotal() const { return bytes_total_; }
  const std::filesystem::path& file() const { return file_; }

 private:
  void readAhead();
  bool packetIsComplete() const;
  void readBlock();
  void sortEvents();
  void takeLines(const char* begin, const char* end);
  const char* parsePlainLine(const char* text, Event& event) const;
  std::optional<Event> parseLine(std::string_view line, bool unterminated) const;
  void take(const Event& event);
  std::string place() const;

  std::filesystem::path file_;
  CameraSize size_;
  std::ifstream stream_;
  std::uint64_t bytes_total_ = 0;
  std::uint64_t bytes_read_ = 0;
  bool ended_ = false;
  std::exception_ptr error_;  // of the wrong line

  std::vector<char> block_;  // text
  std::size_t carried_ = 0;  // bytes of an incomplete line at its beginning
  std::uint64_t line_ = 0;   // number of the current line

  std::vector<Event> events_;  // sorted between calls; returned before first_
  std::size_t first_ = 0;
  std::int64_t newest_ns_ = -kEndOfTimeNs;
  bool disordered_ = false;
  std::uint64_t sorted_events_ = 0;
};

}  // namespace efm
