// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/sensors/evt_decoder.h"

#include <algorithm>
#include <cstring>

#include "plugin/recordings/sensors/evt_code.h"

namespace efm {
namespace evt {
namespace {

/// Room for the events of many words, and for those that a vector writes behind its last.
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
  }
}

/// A word at any address. Hosts are little-endian, like the encodings.
template <typename Code>
typename Code::Word wordAt(const std::uint8_t* data) {
  typename Code::Word word;
  std::memcpy(&word, data, sizeof(word));
  return Code::load(word);
}

/// Decodes `count` words, which give at most kScratchEvents. @return the end of the events.
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

/// Follows the TIME_HIGH words. Most groups of words have none, or only repeat the last one: the
/// first loop, which the compiler vectorises, finds them.
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
      // A word alone until the state is complete: a word changes the state or has events.
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

/// Completes the word that the last call had only in part, and moves behind its bytes.
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
  return static_cast<std::int64_t>(evt::kNsPerUs * 64 * std::get<Evt2State>(state_).high);
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
