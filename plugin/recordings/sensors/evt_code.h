// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "plugin/recordings/sensors/evt_decoder.h"

namespace efm::evt {

inline constexpr std::uint64_t kNsPerUs = 1000;

/// The upper four bits of a word.
enum EvtType : unsigned {
  kOff = 0,
  kOn = 1,
  kTimeHigh = 8,
  // EVT 3.0 only:
  kAddrY = 0,
  kAddrX = 2,
  kVectBaseX = 3,
  kVect12 = 4,
  kVect8 = 5,
  kTimeLow = 6,
};

template <typename Word>
unsigned typeOf(Word word) {
  return static_cast<unsigned>(word >> (8 * sizeof(Word) - 4));
}

/// Bits of a word, as a coordinate.
template <typename Word>
std::uint16_t bitsOf(Word word, unsigned first, unsigned count) {
  return static_cast<std::uint16_t>((word >> first) & ((1U << count) - 1));
}

inline Event* putEvent(Event* at, std::uint64_t t_ns, unsigned x, std::uint16_t y, bool polarity) {
  at->t_ns = static_cast<std::int64_t>(t_ns);
  at->x = static_cast<std::uint16_t>(x);
  at->y = y;
  at->polarity = polarity;
  return at + 1;
}

/// Writes an event for each set bit; bit i is the column x + i. Four at a time: a branch for each
/// bit would often be predicted wrongly. Up to three events behind the last are overwritten.
/// @return the end of the events.
inline Event* putVector(Event* at, std::uint32_t bits, std::uint64_t t_ns, unsigned x,
                        std::uint16_t y, bool polarity) {
  while (bits != 0) {
    for (int i = 0; i < 4; ++i) {
      putEvent(at, t_ns, x + static_cast<unsigned>(__builtin_ctz(bits | 1U << 31U)), y, polarity);
      at += bits != 0 ? 1 : 0;
      bits &= bits - 1;
    }
  }
  return at;
}

/// The events' time and row are known.
inline bool isComplete(const Evt2State& state) { return state.has_high; }
inline bool isComplete(const Evt3State& state) {
  return state.has_high && state.has_low && state.has_y;
}

/// @param value of a TIME_HIGH, 28 bits.
inline void setHigh(Evt2State& state, std::uint32_t value) {
  constexpr std::uint64_t kRange = std::uint64_t{1} << 28U;
  const std::uint64_t step = (value - state.high) % kRange;
  const std::uint64_t back = step >= kRange / 2 ? kRange : 0;
  state.high = state.begun ? state.high + step - back : value;
  state.begun = true;
  state.has_high = true;
}

/// @param value of a TIME_HIGH, 12 bits.
inline void setHigh(Evt3State& state, std::uint32_t value) {
  constexpr std::uint64_t kRange = std::uint64_t{1} << 12U;
  const bool first = !state.begun;
  const std::uint64_t step = first ? value : (value - state.high) % kRange;
  state.begun = true;
  state.has_high = true;
  if (!first && step == kRange - 1) {
    --state.high;  // valid from the next TIME_LOW
    return;
  }
  state.high += step;
  if (step != 0) state.t_ns = kNsPerUs * (kRange * state.high + state.low);
}

/// @param value of a TIME_LOW, 12 bits.
inline void setLow(Evt3State& state, std::uint16_t value) {
  constexpr std::uint64_t kRange = std::uint64_t{1} << 12U;
  std::uint64_t time = kRange * state.high + value;
  const bool high_is_late =
      state.has_low && static_cast<std::int64_t>(state.low_time - time) > std::int64_t{kRange / 2};
  if (high_is_late) {
    ++state.high;
    time += kRange;
  }
  state.low = value;
  state.low_time = time;
  state.t_ns = kNsPerUs * time;
  state.has_low = state.has_high;
}

/// A word of an encoding, and what it does to the state. `step` writes its events to `at` and
/// returns their end.
struct Evt2Code {
  using State = Evt2State;
  using Word = std::uint32_t;
  static constexpr std::size_t kMaxEvents = 1;

  static Word load(Word word) { return word; }
  static std::uint32_t highOf(Word word) { return word & 0x0fff'ffffU; }
  static Word highWord(const State& state) {
    return kTimeHigh << 28U | (static_cast<Word>(state.high) & 0x0fff'ffffU);
  }
  static Event* step(State& state, Word word, Event* at) {
    const unsigned type = typeOf(word);
    if (type <= kOn) {
      const std::uint64_t t_us = 64 * state.high + bitsOf(word, 22, 6);
      return putEvent(at, kNsPerUs * t_us, bitsOf(word, 11, 11), bitsOf(word, 0, 11), type == kOn);
    }
    if (type == kTimeHigh) setHigh(state, highOf(word));
    return at;
  }
};

template <bool kLegacy>
struct Evt21Code {
  using State = Evt2State;
  using Word = std::uint64_t;
  static constexpr std::size_t kMaxEvents = 32;

  static Word load(Word word) { return kLegacy ? word << 32U | word >> 32U : word; }
  static std::uint32_t highOf(Word word) {
    return static_cast<std::uint32_t>(word >> 32U) & 0x0fff'ffffU;
  }
  static Word highWord(const State& state) {
    return Word{kTimeHigh} << 60U | (state.high & 0x0fff'ffffU) << 32U;
  }
  static Event* step(State& state, Word word, Event* at) {
    const unsigned type = typeOf(word);
    if (type <= kOn) {
      const std::uint64_t t_us = 64 * state.high + bitsOf(word, 54, 6);
      return putVector(at, static_cast<std::uint32_t>(word), kNsPerUs * t_us, bitsOf(word, 43, 11),
                       bitsOf(word, 32, 11), type == kOn);
    }
    if (type == kTimeHigh) setHigh(state, highOf(word));
    return at;
  }
};

struct Evt3Code {
  using State = Evt3State;
  using Word = std::uint16_t;
  static constexpr std::size_t kMaxEvents = 12;

  static Word load(Word word) { return word; }
  static std::uint32_t highOf(Word word) { return bitsOf(word, 0, 12); }
  static Word highWord(const State& state) {
    return static_cast<Word>(kTimeHigh << 12U | (state.high & 0xfffU));
  }
  static Event* step(State& state, Word word, Event* at) {
    const bool polarity = bitsOf(word, 11, 1) != 0;
    switch (typeOf(word)) {
      case kAddrY:
        state.y = bitsOf(word, 0, 11);
        state.has_y = true;
        break;
      case kAddrX:
        return putEvent(at, state.t_ns, bitsOf(word, 0, 11), state.y, polarity);
      case kVectBaseX:
        state.x = bitsOf(word, 0, 11);
        state.polarity = polarity;
        break;
      case kVect12:
        return stepVector<12>(state, word, at);
      case kVect8:
        return stepVector<8>(state, word, at);
      case kTimeLow:
        setLow(state, bitsOf(word, 0, 12));
        break;
      case kTimeHigh:
        setHigh(state, highOf(word));
        break;
      default:
        break;
    }
    return at;
  }
  template <unsigned kPixels>
  static Event* stepVector(State& state, Word word, Event* at) {
    at = putVector(at, bitsOf(word, 0, kPixels), state.t_ns, state.x, state.y, state.polarity);
    state.x = static_cast<std::uint16_t>(state.x + kPixels);
    return at;
  }
};

}  // namespace efm::evt
