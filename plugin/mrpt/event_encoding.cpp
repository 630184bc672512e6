// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/mrpt/event_encoding.h"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <stdexcept>
#include <string>

namespace efm {
namespace {

constexpr std::uint8_t kColumns = 1;
constexpr std::uint8_t kZstdColumns = 2;
constexpr std::size_t kMaxEventSize =
    15;  // 10 bytes for the time, 4 for the pixel, 1 for the polarity
constexpr std::int64_t kTicksNs[] = {1, 1000};
constexpr std::size_t kHeaderSize = 10;  // encoding, tick, first time

/// Writes an integer and moves `to` behind the written bytes.
void putVarint(std::uint8_t*& to, std::uint64_t value) {
  while (value >= 0x80) {
    *to++ = static_cast<std::uint8_t>(value | 0x80);
    value >>= 7;
  }
  *to++ = static_cast<std::uint8_t>(value);
}

/// Reads bytes in order. A read past the end is an error.
class ByteReader {
 public:
  explicit ByteReader(const std::vector<std::uint8_t>& bytes) : bytes_(bytes) {}

  std::size_t left() const { return bytes_.size() - at_; }
  std::uint8_t byte() { return *take(1); }
  const std::uint8_t* take(std::size_t count) {
    if (count > left()) throw std::runtime_error("encoded events end too early");
    at_ += count;
    return bytes_.data() + at_ - count;
  }
  std::uint64_t varint() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      const std::uint8_t next = byte();
      value |= static_cast<std::uint64_t>(next & 0x7F) << shift;
      if ((next & 0x80) == 0) return value;
    }
    throw std::runtime_error("encoded events: a time step is too large");
  }

 private:
  const std::vector<std::uint8_t>& bytes_;
  std::size_t at_ = 0;
};

/// Returns the time difference, which wraps around as unsigned numbers do: it always exists.
std::int64_t stepBetween(std::int64_t from_ns, std::int64_t to_ns) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(to_ns) -
                                   static_cast<std::uint64_t>(from_ns));
}
bool allStepsAreWholeMicroseconds(const std::vector<Event>& events) {
  const auto broken = [](const Event& before, const Event& event) {
    return stepBetween(before.t_ns, event.t_ns) % kTicksNs[1] != 0;
  };
  return std::adjacent_find(events.begin(), events.end(), broken) == events.end();
}
std::int64_t advance(std::int64_t t_ns, std::int64_t steps, std::int64_t tick_ns) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(t_ns) +
                                   static_cast<std::uint64_t>(steps) *
                                       static_cast<std::uint64_t>(tick_ns));
}

/// Encodes 0, -1, 1, -2, ... as 0, 1, 2, 3, ...: small steps of both signs need few bytes.
std::uint64_t zigzag(std::int64_t value) {
  return (static_cast<std::uint64_t>(value) << 1) ^ (value < 0 ? ~std::uint64_t{0} : 0);
}
std::int64_t unzigzag(std::uint64_t code) {
  return static_cast<std::int64_t>((code >> 1) ^ (~(code & 1) + 1));
}

std::vector<std::uint8_t> encodeColumns(const std::vector<Event>& events) {
  const std::size_t count = events.size();
  std::vector<std::uint8_t> bytes(kHeaderSize + kMaxEventSize * count);
  const std::uint8_t tick = allStepsAreWholeMicroseconds(events) ? 1 : 0;
  std::uint8_t* to = bytes.data();
  *to++ = kColumns;
  *to++ = tick;
  const auto first = static_cast<std::uint64_t>(events.front().t_ns);
  for (int shift = 0; shift < 64; shift += 8) *to++ = static_cast<std::uint8_t>(first >> shift);
  // Each branch has a constant divisor, which is faster.
  const auto put_steps = [&](auto tick_ns) {
    for (std::size_t i = 1; i < count; ++i) {
      putVarint(to, zigzag(stepBetween(events[i - 1].t_ns, events[i].t_ns) / tick_ns()));
    }
  };
  if (tick == 1) {
    put_steps([] { return kTicksNs[1]; });
  } else {
    put_steps([] { return kTicksNs[0]; });
  }
  for (const Event& event : events) {
    to[0] = static_cast<std::uint8_t>(event.x);
    to[count] = static_cast<std::uint8_t>(event.x >> 8);
    to[2 * count] = static_cast<std::uint8_t>(event.y);
    to[3 * count] = static_cast<std::uint8_t>(event.y >> 8);
    ++to;
  }
  to += 3 * count;
  for (std::size_t i = 0; i < count; i += 8) {
    unsigned bits = 0;
    for (std::size_t k = 0; k < 8 && i + k < count; ++k) {
      bits |= static_cast<unsigned>(events[i + k].polarity) << k;
    }
    *to++ = static_cast<std::uint8_t>(bits);
  }
  bytes.resize(static_cast<std::size_t>(to - bytes.data()));
  return bytes;
}

std::vector<Event> decodeColumns(const std::vector<std::uint8_t>& bytes, std::size_t count) {
  ByteReader reader(bytes);
  std::vector<Event> events;
  if (const std::uint8_t encoding = reader.byte(); encoding != kColumns) {
    throw std::runtime_error(
        fmt::format("encoded events: encoding {}, this program knows 1 and 2", encoding));
  }
  const std::uint8_t tick = reader.byte();
  // Each event needs at least 4 bytes, for its coordinates.
  if (tick > 1 || count == 0 || count > bytes.size() / 4) {
    throw std::runtime_error("encoded events: a header that cannot be");
  }
  std::uint64_t first = 0;
  for (int shift = 0; shift < 64; shift += 8) {
    first |= static_cast<std::uint64_t>(reader.byte()) << shift;
  }
  events.resize(count);
  events[0].t_ns = static_cast<std::int64_t>(first);
  for (std::size_t i = 1; i < count; ++i) {
    events[i].t_ns = advance(events[i - 1].t_ns, unzigzag(reader.varint()), kTicksNs[tick]);
  }
  const std::uint8_t* x_low = reader.take(count);
  const std::uint8_t* x_high = reader.take(count);
  const std::uint8_t* y_low = reader.take(count);
  const std::uint8_t* y_high = reader.take(count);
  const std::uint8_t* polarity = reader.take((count + 7) / 8);
  if (reader.left() != 0) throw std::runtime_error("encoded events: more bytes than events");
  for (std::size_t i = 0; i < count; ++i) {
    events[i].x = static_cast<std::uint16_t>(x_low[i] | (x_high[i] << 8));
    events[i].y = static_cast<std::uint16_t>(y_low[i] | (y_high[i] << 8));
    events[i].polarity = ((polarity[i / 8] >> (i % 8)) & 1) != 0;
  }
  return events;
}

/// Converts encoding 1 to encoding 2.
std::vector<std::uint8_t> compressed(const std::vector<std::uint8_t>& bytes) {
  constexpr int kFastest = 1;
  std::vector<std::uint8_t> result(1 + ZSTD_compressBound(bytes.size() - 1));
  result[0] = kZstdColumns;
  const std::size_t size = ZSTD_compress(result.data() + 1, result.size() - 1, bytes.data() + 1,
                                         bytes.size() - 1, kFastest);
  if (ZSTD_isError(size)) {
    throw std::runtime_error(std::string("events cannot be compressed: ") +
                             ZSTD_getErrorName(size));
  }
  result.resize(1 + size);
  return result;
}

/// Converts encoding 2 to encoding 1. @param count limits the memory for damaged bytes.
std::vector<std::uint8_t> decompressed(const std::vector<std::uint8_t>& bytes, std::size_t count) {
  const auto size = ZSTD_getFrameContentSize(bytes.data() + 1, bytes.size() - 1);
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR ||
      size > kHeaderSize + kMaxEventSize * count) {
    throw std::runtime_error("encoded events: a compressed size that cannot be");
  }
  std::vector<std::uint8_t> result(1 + size);
  result[0] = kColumns;
  const std::size_t read =
      ZSTD_decompress(result.data() + 1, size, bytes.data() + 1, bytes.size() - 1);
  if (ZSTD_isError(read) || read != size) {
    throw std::runtime_error("encoded events: their compression is damaged");
  }
  return result;
}

}  // namespace

std::vector<std::uint8_t> encodeEvents(const std::vector<Event>& events,
                                       EventCompression compression) {
  if (events.empty()) return {};
  std::vector<std::uint8_t> bytes = encodeColumns(events);
  return compression == EventCompression::kZstd ? compressed(bytes) : bytes;
}

std::vector<Event> decodeEvents(const std::vector<std::uint8_t>& bytes, std::size_t count) {
  if (count == 0 && bytes.empty()) return {};
  if (!bytes.empty() && bytes.front() == kZstdColumns) {
    return decodeColumns(decompressed(bytes, count), count);
  }
  return decodeColumns(bytes, count);
}

}  // namespace efm
