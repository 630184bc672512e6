// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/sensors/evt_decoder.h"

#include <algorithm>
#include <cstring>
#include <type_traits>

namespace efm {
namespace evt {
namespace {

constexpr std::uint64_t kNsPerUs = 1000;

/// The type of a word: its upper four bits.
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

/// Returns bits of a word as a coordinate.
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

/// Writes an event for each set bit; bit i is the column x + i. It writes four at a time: a branch
/// for each bit would often be predicted wrongly. Up to three events after the last one are
/// overwritten.
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

/// Returns whether the events' time and row are known.
inline bool isComplete(const Evt2State& state) { return state.has_high; }
inline bool isComplete(const DatState& /*state*/) { return true; }
inline bool isComplete(const Evt3State& state) {
  return state.has_high && state.has_low && state.has_y;
}

/// @param value value of a TIME_HIGH, 28 bits, or of the time of DAT, 32 bits.
template <typename State>
void setHigh(State& state, std::uint32_t value) {
  constexpr unsigned kBits = std::is_same_v<State, DatState> ? 32 : 28;
  constexpr std::uint64_t kRange = std::uint64_t{1} << kBits;
  const std::uint64_t step = (value - state.high) % kRange;
  const std::uint64_t back = step >= kRange / 2 ? kRange : 0;
  state.high = state.begun ? state.high + step - back : value;
  state.begun = true;
  state.has_high = true;
}

/// The register wraps after 16.8 s, so that a damaged word looks like a pause. If the words after a
/// jump go on from before it, they do so in time, too.
/// @param value value of a TIME_HIGH, 12 bits.
inline void setHigh(Evt3State& state, std::uint32_t value) {
  constexpr std::uint64_t kRange = std::uint64_t{1} << 12U;
  constexpr std::uint64_t kNear = 64;  // 0.26 s
  constexpr int kMaxWords = 16;
  const bool first = !state.begun;
  if (state.words_of_jump > 0) {
    const std::uint64_t on = (value - state.high_before_jump + kNear) % kRange;
    if (on <= 2 * kNear && state.high_before_jump + on >= kNear) {
      state.words_of_jump = 0;
      state.high = state.high_before_jump + on - kNear;
      state.low_time = kRange * state.high;  // the next TIME_LOW belongs to it
      state.t_ns = kNsPerUs * (kRange * state.high + state.low);
      return;
    }
    state.words_of_jump = (state.words_of_jump + 1) % kMaxWords;
  }
  const std::uint64_t step = first ? value : (value - state.high) % kRange;
  state.begun = true;
  state.has_high = true;
  if (!first && step == kRange - 1) {
    --state.high;  // valid from the next TIME_LOW
    return;
  }
  if (!first && step > kNear && state.words_of_jump == 0) {
    state.high_before_jump = state.high;
    state.words_of_jump = 1;
  }
  state.high += step;
  if (step != 0) state.t_ns = kNsPerUs * (kRange * state.high + state.low);
}

/// @param value value of a TIME_LOW, 12 bits.
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

/// The words of an encoding and their effect on the state. `step` writes the events of a word to
/// `at` and returns their end.
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

struct DatCode {
  using State = DatState;
  using Word = std::uint64_t;
  static constexpr std::size_t kMaxEvents = 1;

  static Word load(Word word) { return word; }
  static std::uint32_t highOf(Word word) { return static_cast<std::uint32_t>(word); }
  static Word highWord(const State& state) { return state.high; }
  static Event* step(State& state, Word word, Event* at) {
    setHigh(state, highOf(word));
    return putEvent(at, kNsPerUs * state.high, bitsOf(word, 32, 14), bitsOf(word, 46, 14),
                    bitsOf(word, 60, 1) != 0);
  }
};

/// Space for the events of many words, and for the events that a vector writes after its last one.
constexpr std::size_t kScratchEvents = 4096;
constexpr std::size_t kScanWords = 64;

/// Calls `call` with the code of an encoding.
template <typename Call>
void withCode(EvtEncoding encoding, const Call& call) {
  switch (encoding) {
    case EvtEncoding::kEvt2:
      return call(Evt2Code());
    case EvtEncoding::kEvt21:
      return call(Evt21Code<false>());
    case EvtEncoding::kEvt21Legacy:
      return call(Evt21Code<true>());
    case EvtEncoding::kEvt3:
      return call(Evt3Code());
    case EvtEncoding::kDat:
      return call(DatCode());
  }
}

/// Reads a word at any address. Hosts are little-endian, like the encodings.
template <typename Code>
typename Code::Word wordAt(const std::uint8_t* data) {
  typename Code::Word word;
  std::memcpy(&word, data, sizeof(word));
  return Code::load(word);
}

/// Decodes `count` words, which have at most kScratchEvents events. @return the end of the events.
template <typename Code>
Event* decodeWords(typename Code::State& kept, const std::uint8_t* data, std::size_t count,
                   Event* at) {
  typename Code::State state = kept;  // stays in registers: nothing else refers to it
  for (std::size_t i = 0; i < count; ++i) {
    at = Code::step(state, wordAt<Code>(data + i * sizeof(typename Code::Word)), at);
  }
  kept = state;
  return at;
}

/// Follows the TIME_HIGH words. Most groups of words have no TIME_HIGH, or only repeat the last
/// one: the first loop, which the compiler vectorises, finds these groups.
template <typename Code>
void scanWords(typename Code::State& state, const std::uint8_t* data, std::size_t count) {
  using Word = typename Code::Word;
  Word steps = 0;
  const Word known = Code::highWord(state);
  for (std::size_t i = 0; i < count; ++i) {
    const Word word = wordAt<Code>(data + i * sizeof(Word));
    const bool is_step = (typeOf(word) == kTimeHigh) & (word != known);
    steps = static_cast<Word>(steps | Word{is_step});
  }
  if (steps == 0 && state.has_high) return;
  for (std::size_t i = 0; i < count; ++i) {
    const Word word = wordAt<Code>(data + i * sizeof(Word));
    if (typeOf(word) == kTimeHigh) setHigh(state, Code::highOf(word));
  }
}

}  // namespace
}  // namespace evt

EvtDecoder::EvtDecoder(EvtEncoding encoding) : encoding_(encoding) { reset(); }

void EvtDecoder::reset() {
  carried_ = 0;
  evt::withCode(encoding_, [this](auto code) { state_ = typename decltype(code)::State(); });
}

void EvtDecoder::skipGap() {
  carried_ = 0;
  std::visit([](auto& state) { state.has_high = false; }, state_);
  if (auto* const state = std::get_if<Evt3State>(&state_)) state->has_low = state->has_y = false;
}

void EvtDecoder::decode(const std::uint8_t* data, std::size_t size, std::vector<Event>& events) {
  scratch_.resize(evt::kScratchEvents);
  evt::withCode(encoding_, [&](auto code) {
    using Code = decltype(code);
    constexpr std::size_t kWord = sizeof(typename Code::Word);
    constexpr std::size_t kBatch = evt::kScratchEvents / Code::kMaxEvents - 1;
    auto& state = std::get<typename Code::State>(state_);
    const auto decode_some = [&](const std::uint8_t* words, std::size_t count) {
      const bool complete = evt::isComplete(state);
      Event* const begin = scratch_.data();
      Event* const end = evt::decodeWords<Code>(state, words, count, begin);
      if (complete) {
        events.insert(events.end(), begin, end);
      } else {
        undated_events_ += static_cast<std::uint64_t>(end - begin);
      }
    };
    takeCarried(kWord, data, size, decode_some);
    for (std::size_t words = size / kWord; words > 0;) {
      // One word at a time until the state is complete: a word changes the state or has events.
      const std::size_t count = evt::isComplete(state) ? std::min(words, kBatch) : 1;
      decode_some(data, count);
      data += count * kWord;
      words -= count;
    }
    carry(data, size % kWord);
  });
}

void EvtDecoder::scanTime(const std::uint8_t* data, std::size_t size) {
  evt::withCode(encoding_, [&](auto code) {
    using Code = decltype(code);
    using Word = typename Code::Word;
    auto& state = std::get<typename Code::State>(state_);
    const auto scan = [&](const std::uint8_t* words, std::size_t count) {
      for (std::size_t i = 0; i < count; i += evt::kScanWords) {
        evt::scanWords<Code>(state, words + i * sizeof(Word), std::min(evt::kScanWords, count - i));
      }
    };
    takeCarried(sizeof(Word), data, size, scan);
    scan(data, size / sizeof(Word));
    carry(data + size - size % sizeof(Word), size % sizeof(Word));
  });
  if (auto* const state = std::get_if<Evt3State>(&state_)) state->has_low = state->has_y = false;
}

/// Completes the word that the last call had only in part, and skips its bytes.
template <typename Use>
void EvtDecoder::takeCarried(std::size_t word_size, const std::uint8_t*& data, std::size_t& size,
                             const Use& use) {
  if (carried_ == 0) return;
  const std::size_t taken = std::min(word_size - carried_, size);
  carry(data, taken);
  data += taken;
  size -= taken;
  if (carried_ < word_size) return;
  carried_ = 0;
  use(carry_.data(), 1);
}

void EvtDecoder::carry(const std::uint8_t* data, std::size_t size) {
  std::copy_n(data, size, carry_.begin() + static_cast<std::ptrdiff_t>(carried_));
  carried_ += size;
}

std::int64_t EvtDecoder::timeHighNs() const {
  if (const auto* const state = std::get_if<Evt3State>(&state_)) {
    return static_cast<std::int64_t>(evt::kNsPerUs * 4096 * state->high);
  }
  const auto* const state = std::get_if<Evt2State>(&state_);
  return static_cast<std::int64_t>(evt::kNsPerUs * 64 * (state != nullptr ? state->high : 0));
}

bool EvtDecoder::hasTime() const {
  return std::visit([](const auto& state) { return state.begun; }, state_);
}

std::size_t EvtDecoder::wordBytes() const {
  std::size_t bytes = 0;
  evt::withCode(encoding_, [&](auto code) { bytes = sizeof(typename decltype(code)::Word); });
  return bytes;
}

}  // namespace efm
