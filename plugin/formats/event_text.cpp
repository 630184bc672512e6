// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/formats/event_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "mapping/options/quoted_text.h"
#include "mapping/options/text_parsing.h"

namespace efm {
namespace {

constexpr std::size_t kBlockBytes = std::size_t{1} << 20;

bool isDigit(char c) { return c >= '0' && c <= '9'; }
bool isBlank(char c) { return c == ' ' || c == '\t'; }

struct Digits {
  std::uint64_t value;  // of at most 19 digits; wrapped beyond
  std::ptrdiff_t count;
};

/// Reads digits and moves `text` behind them.
Digits takeDigits(const char*& text) {
  const char* const begin = text;
  std::uint64_t value = 0;
  for (; isDigit(*text); ++text) value = value * 10 + static_cast<std::uint64_t>(*text - '0');
  return {value, text - begin};
}

/// Moves `text` behind blanks. @return whether there were any.
bool takeBlanks(const char*& text) {
  const bool any = isBlank(*text);
  while (isBlank(*text)) ++text;
  return any;
}

/// The end of the grid's period that contains a time.
std::int64_t periodEnd(std::int64_t t_ns) {
  std::int64_t rest_ns = t_ns % kPacketPeriodNs;
  if (rest_ns < 0) rest_ns += kPacketPeriodNs;
  return t_ns - rest_ns + kPacketPeriodNs;
}

std::optional<std::uint16_t> parsePixel(std::string_view text, int side) {
  const std::optional<int> value = parseNumber<int>(text);
  if (!value || *value < 0 || *value >= side) return std::nullopt;
  return static_cast<std::uint16_t>(*value);
}

}  // namespace

EventTextReader::EventTextReader(std::filesystem::path file, CameraSize size)
    : file_(std::move(file)), size_(size), stream_(file_, std::ios::binary) {
  std::error_code error;
  if (!stream_ || std::filesystem::is_directory(file_, error)) {
    throw std::runtime_error(file_.string() + ": cannot be opened for reading");
  }
  bytes_total_ = std::filesystem::file_size(file_, error);
  if (error) bytes_total_ = 0;  // a pipe
}

std::vector<Event> EventTextReader::nextPacket() {
  readAhead();
  if (first_ == events_.size()) {
    if (error_) std::rethrow_exception(error_);
    return {};
  }
  const auto begin = events_.begin() + static_cast<std::ptrdiff_t>(first_);
  const auto end = std::partition_point(
      begin, events_.end(),
      [end_ns = periodEnd(begin->t_ns)](const Event& event) { return event.t_ns < end_ns; });
  first_ = static_cast<std::size_t>(end - events_.begin());
  return {begin, end};
}

std::optional<std::int64_t> EventTextReader::nextTime() {
  readAhead();
  if (first_ < events_.size()) return events_[first_].t_ns;
  if (!error_) return std::nullopt;
  if (newest_ns_ == -kEndOfTimeNs) std::rethrow_exception(error_);
  return newest_ns_;
}

void EventTextReader::readAhead() {
  while (!ended_ && !error_ && !packetIsComplete()) {
    events_.erase(events_.begin(), events_.begin() + static_cast<std::ptrdiff_t>(first_));
    first_ = 0;
    try {
      readBlock();
    } catch (const std::runtime_error&) {
      error_ = std::current_exception();  // thrown after the events above it
    }
    sortEvents();
  }
}

void EventTextReader::sortEvents() {
  if (!disordered_) return;
  std::stable_sort(events_.begin(), events_.end(),
                   [](const Event& a, const Event& b) { return a.t_ns < b.t_ns; });
  disordered_ = false;
}

/// Whether no further event can belong to the first packet.
bool EventTextReader::packetIsComplete() const {
  return first_ < events_.size() &&
         newest_ns_ - kMaxEventDelayNs >= periodEnd(events_[first_].t_ns);
}

void EventTextReader::readBlock() {
  block_.resize(kBlockBytes);
  stream_.read(block_.data() + carried_, static_cast<std::streamsize>(kBlockBytes - carried_));
  if (stream_.bad()) throw std::runtime_error(file_.string() + ": cannot be read to its end");
  const auto count = static_cast<std::size_t>(stream_.gcount());
  bytes_read_ += count;
  ended_ = stream_.eof();

  const std::string_view text(block_.data(), carried_ + count);
  const std::size_t newline = text.rfind('\n');
  const std::size_t whole = newline == std::string_view::npos ? 0 : newline + 1;
  takeLines(text.data(), text.data() + whole);
  carried_ = text.size() - whole;
  if (ended_ && carried_ > 0) {
    ++line_;
    if (const auto event = parseLine(text.substr(whole), true)) take(*event);
  } else if (carried_ == kBlockBytes) {
    ++line_;
    throw std::runtime_error(fmt::format("{}{}: expected t x y p, not a line of over {} bytes",
                                         place(), inQuotes(text), kBlockBytes));
  }
  std::copy(text.begin() + static_cast<std::ptrdiff_t>(whole), text.end(), block_.begin());
}

void EventTextReader::takeLines(const char* begin, const char* end) {
  assert(begin == end || end[-1] == '\n');
  Event event;
  while (begin != end) {
    ++line_;
    if (const char* const next = parsePlainLine(begin, event)) {
      take(event);
      begin = next;
    } else {
      const char* const newline = std::find(begin, end, '\n');
      const std::string_view line(begin, static_cast<std::size_t>(newline - begin));
      if (const auto parsed = parseLine(line, false)) take(*parsed);
      begin = newline + 1;
    }
  }
}

/// The fast path for a plain line. Each step stops at the newline at the latest.
/// @return the next line; null if `parseLine` must parse this line.
const char* EventTextReader::parsePlainLine(const char* text, Event& event) const {
  constexpr std::array<std::uint64_t, 10> kNanosecondsOfDigits = {
      1'000'000'000, 100'000'000, 10'000'000, 1'000'000, 100'000, 10'000, 1'000, 100, 10, 1};
  constexpr int kMaxSecondDigits = 10;
  constexpr int kMaxPixelDigits = 5;

  const Digits seconds = takeDigits(text);
  if (seconds.count < 1 || seconds.count > kMaxSecondDigits) return nullptr;
  std::uint64_t t_ns = seconds.value * kNanosecondsOfDigits[0];
  if (*text == '.') {
    const Digits decimals = takeDigits(++text);
    if (decimals.count >= static_cast<std::ptrdiff_t>(kNanosecondsOfDigits.size())) return nullptr;
    t_ns += decimals.value * kNanosecondsOfDigits[static_cast<std::size_t>(decimals.count)];
  }
  if (t_ns >= static_cast<std::uint64_t>(kEndOfTimeNs) || !takeBlanks(text)) return nullptr;

  const Digits x = takeDigits(text);
  if (x.count < 1 || x.count > kMaxPixelDigits || !takeBlanks(text)) return nullptr;
  const Digits y = takeDigits(text);
  if (y.count < 1 || y.count > kMaxPixelDigits || !takeBlanks(text)) return nullptr;
  if (x.value >= static_cast<std::uint64_t>(size_.width)) return nullptr;
  if (y.value >= static_cast<std::uint64_t>(size_.height)) return nullptr;

  const char polarity = *text;
  if (polarity != '0' && polarity != '1') return nullptr;
  ++text;
  if (*text == '\r') ++text;
  if (*text != '\n') return nullptr;

  event.t_ns = static_cast<std::int64_t>(t_ns);
  event.x = static_cast<std::uint16_t>(x.value);
  event.y = static_cast<std::uint16_t>(y.value);
  event.polarity = polarity == '1';
  return text + 1;
}

std::optional<Event> EventTextReader::parseLine(std::string_view line, bool unterminated) const {
  constexpr std::size_t kFields = 4;
  const std::string_view content = line.substr(0, line.find('#'));
  const std::vector<std::string_view> fields = splitWords(content);
  if (fields.empty()) return std::nullopt;
  if (fields.size() < kFields && unterminated) {
    throw std::runtime_error(fmt::format(
        "{}{}: expected t x y p, but the file ends within the line", place(), inQuotes(content)));
  }
  if (fields.size() != kFields) {
    throw std::runtime_error(fmt::format("{}{}: expected 4 fields, t x y p, not {}", place(),
                                         inQuotes(content), fields.size()));
  }

  const auto fail = [&](const char* name, std::string_view value, const std::string& expected) {
    return std::runtime_error(
        fmt::format("{}{} = {}: expected {}", place(), name, inQuotes(value), expected));
  };
  const auto side_of = [&](const char* name, std::string_view value, int side) {
    const std::optional<std::uint16_t> pixel = parsePixel(value, side);
    if (pixel) return *pixel;
    throw fail(name, value,
               fmt::format("a whole number from 0 to {} (the sensor has {}x{} pixels)", side - 1,
                           size_.width, size_.height));
  };
  const std::optional<std::int64_t> t_ns = parseSeconds(fields[0]);
  if (!t_ns || *t_ns >= kEndOfTimeNs || *t_ns <= -kEndOfTimeNs) {
    throw fail("t", fields[0], "a time in decimal seconds");
  }
  Event event;
  event.t_ns = *t_ns;
  event.x = side_of("x", fields[1], size_.width);
  event.y = side_of("y", fields[2], size_.height);
  if (fields[3] != "0" && fields[3] != "1") throw fail("p", fields[3], "polarity 0 or 1");
  event.polarity = fields[3] == "1";
  return event;
}

void EventTextReader::take(const Event& event) {
  if (event.t_ns >= newest_ns_) {
    newest_ns_ = event.t_ns;
  } else if (newest_ns_ - event.t_ns <= kMaxEventDelayNs) {
    disordered_ = true;
    ++sorted_events_;
  } else {
    throw std::runtime_error(fmt::format(
        "{}t = '{}': expected events in time order, at most 10 ms before the newest ({})", place(),
        formatSeconds(event.t_ns), formatSeconds(newest_ns_)));
  }
  events_.push_back(event);
}

std::string EventTextReader::place() const { return fmt::format("{}:{}: ", file_.string(), line_); }

}  // namespace efm
