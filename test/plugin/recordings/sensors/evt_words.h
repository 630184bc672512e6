// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "plugin/recordings/sensors/evt_decoder.h"

namespace efm {

/// Appends a little-endian word.
template <typename Word>
void putWord(std::string& bytes, Word word) {
  for (std::size_t i = 0; i < sizeof(Word); ++i) {
    bytes += static_cast<char>(static_cast<std::uint64_t>(word) >> (8 * i) & 0xffU);
  }
}

inline std::string evt3Words(const std::vector<unsigned>& words) {
  std::string bytes;
  for (const unsigned word : words) putWord(bytes, static_cast<std::uint16_t>(word));
  return bytes;
}

/// Returns the number of events from `first` on that fit into one vector of `pixels` columns.
inline std::size_t vectorLength(const std::vector<Event>& events, std::size_t first,
                                unsigned pixels) {
  const Event& base = events[first];
  std::size_t count = 1;
  while (first + count < events.size()) {
    const Event& event = events[first + count];
    if (event.t_ns != base.t_ns || event.y != base.y || event.polarity != base.polarity ||
        event.x <= events[first + count - 1].x || event.x >= base.x + pixels) {
      break;
    }
    ++count;
  }
  return count;
}

inline std::uint32_t vectorBits(const std::vector<Event>& events, std::size_t first,
                                std::size_t count) {
  std::uint32_t bits = 0;
  for (std::size_t i = first; i < first + count; ++i) bits |= 1U << (events[i].x - events[first].x);
  return bits;
}

/// Encodes events in their order, as the format's description says. Their times are whole µs.
inline std::string evtBytes(EvtEncoding encoding, const std::vector<Event>& events) {
  std::string bytes;
  std::int64_t high = -1;  // the last TIME_HIGH
  if (encoding == EvtEncoding::kEvt3) {
    std::int64_t low = -1;
    int y = -1;
    for (std::size_t i = 0; i < events.size();) {
      const Event& event = events[i];
      const std::int64_t t_us = event.t_ns / 1000;
      if (high < 0) high = t_us / 4096 - 1;
      while (high < t_us / 4096)
        putWord(bytes, static_cast<std::uint16_t>(0x8000 | (++high & 0xfff)));
      if (low != t_us % 4096) {
        low = t_us % 4096;
        putWord(bytes, static_cast<std::uint16_t>(0x6000 | low));
      }
      if (y != event.y) {
        y = event.y;
        putWord(bytes, static_cast<std::uint16_t>(y));
      }
      const auto pixel = static_cast<std::uint16_t>((event.polarity ? 0x800 : 0) | event.x);
      const std::size_t count = vectorLength(events, i, 20);
      if (count == 1) {
        putWord(bytes, static_cast<std::uint16_t>(0x2000 | pixel));
      } else {
        const std::uint32_t bits = vectorBits(events, i, count);
        putWord(bytes, static_cast<std::uint16_t>(0x3000 | pixel));
        putWord(bytes, static_cast<std::uint16_t>(0x4000 | (bits & 0xfff)));
        if (bits >> 12U != 0) putWord(bytes, static_cast<std::uint16_t>(0x5000 | bits >> 12U));
      }
      i += count;
    }
    return bytes;
  }
  const bool vectors = encoding != EvtEncoding::kEvt2;
  const auto put = [&](std::uint32_t upper, std::uint32_t lower) {
    if (encoding == EvtEncoding::kEvt21) std::swap(upper, lower);
    putWord(bytes, upper);
    if (vectors) putWord(bytes, lower);
  };
  for (std::size_t i = 0; i < events.size();) {
    const Event& event = events[i];
    const std::int64_t t_us = event.t_ns / 1000;
    if (high != t_us / 64) {
      high = t_us / 64;
      put(0x8000'0000U | static_cast<std::uint32_t>(high & 0xfff'ffff), 0);
    }
    const std::size_t count = vectors ? vectorLength(events, i, 32) : 1;
    put((event.polarity ? 1U << 28U : 0U) | static_cast<std::uint32_t>(t_us % 64) << 22U |
            static_cast<std::uint32_t>(event.x) << 11U | event.y,
        vectorBits(events, i, count));
    i += count;
  }
  return bytes;
}

}  // namespace efm
