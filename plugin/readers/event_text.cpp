// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/readers/event_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>
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

}  // namespace

EventTextStream::EventTextStream(std::filesystem::path file)
    : file_(std::move(file)), stream_(file_, std::ios::binary) {
  std::error_code error;
  if (!stream_ || std::filesystem::is_directory(file_, error)) {
    throw std::runtime_error(file_.string() + ": cannot be opened for reading");
  }
  bytes_total_ = std::filesystem::file_size(file_, error);
  if (error) bytes_total_ = 0;  // a pipe
}

bool EventTextStream::read(std::vector<Event>& events) {
  events.clear();
  lines_.clear();
  if (ended_) return false;
  block_.resize(kBlockBytes);
  stream_.read(block_.data() + carried_, static_cast<std::streamsize>(kBlockBytes - carried_));
  if (stream_.bad()) throw std::runtime_error(file_.string() + ": cannot be read to its end");
  const auto count = static_cast<std::size_t>(stream_.gcount());
  bytes_read_ += count;
  ended_ = stream_.eof();

  const std::string_view text(block_.data(), carried_ + count);
  const std::size_t newline = text.rfind('\n');
  const std::size_t whole = newline == std::string_view::npos ? 0 : newline + 1;
  takeLines(text.data(), text.data() + whole, events);
  carried_ = text.size() - whole;
  if (ended_ && carried_ > 0) {
    ++line_;
    takeLine(text.substr(whole), true, events);
  } else if (carried_ == kBlockBytes) {
    ++line_;
    throw std::runtime_error(fmt::format("{}{}: expected t x y p, not a line of over {} bytes",
                                         place(), inQuotes(text), kBlockBytes));
  }
  std::copy(text.begin() + static_cast<std::ptrdiff_t>(whole), text.end(), block_.begin());
  return true;
}

void EventTextStream::takeLines(const char* begin, const char* end, std::vector<Event>& events) {
  assert(begin == end || end[-1] == '\n');
  lines_.emplace_back(events.size(), line_ + 1);
  Event event;
  while (begin != end) {
    ++line_;
    if (const char* const next = parsePlainLine(begin, event)) {
      events.push_back(event);
      begin = next;
    } else {
      const char* const newline = std::find(begin, end, '\n');
      takeLine({begin, static_cast<std::size_t>(newline - begin)}, false, events);
      begin = newline + 1;
    }
  }
}

void EventTextStream::takeLine(std::string_view line, bool unterminated,
                               std::vector<Event>& events) {
  if (const auto event = parseLine(line, unterminated)) {
    events.push_back(*event);
  } else {
    lines_.emplace_back(events.size(), line_ + 1);
  }
}

/// The fast path for a plain line. Each step stops at the newline at the latest.
/// @return the next line; null if `parseLine` must parse this line.
const char* EventTextStream::parsePlainLine(const char* text, Event& event) const {
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
  constexpr std::uint64_t kMaxPixel = std::numeric_limits<std::uint16_t>::max();
  if (x.value > kMaxPixel || y.value > kMaxPixel) return nullptr;

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

std::optional<Event> EventTextStream::parseLine(std::string_view line, bool unterminated) const {
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
  const auto pixel_of = [&](const char* name, std::string_view value) {
    const std::optional<std::uint16_t> pixel = parseNumber<std::uint16_t>(value);
    if (pixel) return *pixel;
    throw fail(name, value, "a whole number from 0 to 65535");
  };
  const std::optional<std::int64_t> t_ns = parseSeconds(fields[0]);
  if (!t_ns || *t_ns >= kEndOfTimeNs || *t_ns <= -kEndOfTimeNs) {
    throw fail("t", fields[0], "a time in decimal seconds");
  }
  Event event;
  event.t_ns = *t_ns;
  event.x = pixel_of("x", fields[1]);
  event.y = pixel_of("y", fields[2]);
  if (fields[3] != "0" && fields[3] != "1") throw fail("p", fields[3], "polarity 0 or 1");
  event.polarity = fields[3] == "1";
  return event;
}

std::string EventTextStream::positionOf(std::size_t index) const {
  const auto after =
      std::upper_bound(lines_.begin(), lines_.end(), index,
                       [](std::size_t i, const auto& entry) { return i < entry.first; });
  const auto& [first, line] = *std::prev(after);
  return fmt::format("{}:{}", file_.string(), line + (index - first));
}

double EventTextStream::progress() const {
  if (bytes_total_ == 0) return 0;
  return std::min(1.0, static_cast<double>(bytes_read_) / static_cast<double>(bytes_total_));
}

std::string EventTextStream::place() const { return fmt::format("{}:{}: ", file_.string(), line_); }

}  // namespace efm
