// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/sensors/evt_decoder.h"

#include <gmock/gmock.h>

#include <rapidcheck/gtest.h>
#include <string>

#include "test/plugin/recordings/sensors/evt_words.h"

namespace efm {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::vector<Event> decoded(EvtDecoder& decoder, const std::string& bytes) {
  std::vector<Event> events;
  decoder.decode(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), events);
  return events;
}

std::vector<Event> decoded(EvtEncoding encoding, const std::string& bytes) {
  EvtDecoder decoder(encoding);
  return decoded(decoder, bytes);
}

std::vector<std::int64_t> timesOf(const std::vector<Event>& events) {
  std::vector<std::int64_t> times_us;
  for (const Event& event : events) times_us.push_back(event.t_ns / 1000);
  return times_us;
}

TEST(EvtDecoder, Evt2HasAnEventInAWord) {
  std::string bytes;
  for (const std::uint32_t word : {0x0000'0000U,  // before the first time
                                   0x8000'0002U,  // time 128 µs
                                   0x1000'0000U | 3U << 22U | 639U << 11U | 479U,
                                   0xa000'0001U,  // a trigger event
                                   0x0000'0000U | 63U << 22U | 2047U << 11U | 2047U}) {
    putWord(bytes, word);
  }
  EvtDecoder decoder(EvtEncoding::kEvt2);
  EXPECT_THAT(decoded(decoder, bytes),
              ElementsAre(Event{131'000, 639, 479, true}, Event{191'000, 2047, 2047, false}));
  EXPECT_EQ(decoder.undatedEvents(), 1U);
}

TEST(EvtDecoder, Evt21HasAVectorInAWordAndTwoOrdersOfItsHalves) {
  const std::vector<std::uint32_t> words = {
      // pairs of the upper and the lower half
      0x8000'0001U, 0U, 0x1000'0000U | 5U << 22U | 32U << 11U | 7U, 0x8000'0005U,
      0xe000'0000U, 1U, 0x0000'0000U | 6U << 22U | 64U << 11U | 8U, 0x0000'0002U};
  std::string legacy;
  std::string native;
  for (std::size_t i = 0; i < words.size(); i += 2) {
    putWord(legacy, words[i]);
    putWord(legacy, words[i + 1]);
    putWord(native, words[i + 1]);
    putWord(native, words[i]);
  }
  const auto expected = ElementsAre(Event{69'000, 32, 7, true}, Event{69'000, 34, 7, true},
                                    Event{69'000, 63, 7, true}, Event{70'000, 65, 8, false});
  EXPECT_THAT(decoded(EvtEncoding::kEvt21Legacy, legacy), expected);
  EXPECT_THAT(decoded(EvtEncoding::kEvt21, native), expected);
}

TEST(EvtDecoder, Evt3HasAChangeInAWord) {
  EvtDecoder decoder(EvtEncoding::kEvt3);
  EXPECT_THAT(
      decoded(decoder, evt3Words({0x2001, 0x8001, 0x2001, 0x6004, 0x2001,  // before the first row
                                  0x0805,                                  // row 5, second camera
                                  0x2a7f, 0x207f,                          // single events
                                  0x3864, 0x4801, 0x50ff, 0x4002,          // vectors from x = 100
                                  0xa001, 0xe123, 0x7001, 0xf001, 0x1001, 0x9001,  // skipped words
                                  0x0006, 0x2001})),
      ElementsAre(Event{4'100'000, 639, 5, true}, Event{4'100'000, 127, 5, false},
                  Event{4'100'000, 100, 5, true}, Event{4'100'000, 111, 5, true},
                  Event{4'100'000, 112, 5, true}, Event{4'100'000, 113, 5, true},
                  Event{4'100'000, 114, 5, true}, Event{4'100'000, 115, 5, true},
                  Event{4'100'000, 116, 5, true}, Event{4'100'000, 117, 5, true},
                  Event{4'100'000, 118, 5, true}, Event{4'100'000, 119, 5, true},
                  Event{4'100'000, 121, 5, true}, Event{4'100'000, 1, 6, false}));
  EXPECT_EQ(decoder.undatedEvents(), 3U);
}

// A decoder is wrong by 4096 µs in one of these cases if it counts the wraps of TIME_LOW, adds a
// step of TIME_HIGH to the wraps, or sets the lower bits to 0 at a TIME_HIGH.
TEST(EvtDecoder, Evt3TimeFollowsBothRegistersAndALateTimeHigh) {
  constexpr unsigned kEvent = 0x2000;
  struct Case {
    const char* what;
    std::vector<unsigned> words;  // after TIME_HIGH 5 and a row
    std::vector<std::int64_t> times_us;
  };
  constexpr std::int64_t kPeriod = 4096;
  constexpr std::int64_t kBase = 5 * kPeriod;
  const std::vector<Case> cases = {
      {"TIME_HIGH steps, TIME_LOW does not wrap",
       {0x6064, kEvent, 0x8006, 0x60c8, kEvent, 0x8007, 0x612c, kEvent},
       {kBase + 100, kBase + kPeriod + 200, kBase + 2 * kPeriod + 300}},
      {"TIME_HIGH steps, TIME_LOW wraps",
       {0x6fff, kEvent, 0x8006, 0x6000, kEvent},
       {kBase + 4095, kBase + kPeriod}},
      {"TIME_HIGH steps, TIME_LOW is the same and not repeated",
       {0x6064, kEvent, 0x8006, kEvent, 0x8008, kEvent},
       {kBase + 100, kBase + kPeriod + 100, kBase + 3 * kPeriod + 100}},
      {"TIME_HIGH is repeated",
       {0x6064, kEvent, 0x8005, 0x8005, kEvent, 0x6065, kEvent},
       {kBase + 100, kBase + 100, kBase + 101}},
      {"TIME_LOW wraps before TIME_HIGH",
       {0x6ffa, kEvent, 0x6003, kEvent, 0x6004, kEvent, 0x8006, kEvent, 0x6005, kEvent, 0x8007,
        0x6005, kEvent},
       {kBase + 4090, kBase + kPeriod + 3, kBase + kPeriod + 4, kBase + kPeriod + 4,
        kBase + kPeriod + 5, kBase + 2 * kPeriod + 5}},
      {"TIME_LOW wraps before TIME_HIGH, which first repeats the old value",
       {0x6ffa, kEvent, 0x6003, kEvent, 0x8005, kEvent, 0x6004, kEvent, 0x8006, 0x6005, kEvent},
       {kBase + 4090, kBase + kPeriod + 3, kBase + kPeriod + 3, kBase + kPeriod + 4,
        kBase + kPeriod + 5}},
      {"a TIME_HIGH is missing",
       {0x6ffa, kEvent, 0x6003, kEvent, 0x6ffb, kEvent, 0x8007, 0x6001, kEvent},
       {kBase + 4090, kBase + kPeriod + 3, kBase + kPeriod + 4091, kBase + 2 * kPeriod + 1}},
      {"TIME_LOW falls by a few us",
       {0x6064, kEvent, 0x6062, kEvent, 0x6065, kEvent},
       {kBase + 100, kBase + 98, kBase + 101}},
      {"TIME_HIGH falls by one with TIME_LOW",
       {0x8006, 0x6002, kEvent, 0x8005, 0x6ffe, kEvent, 0x8006, 0x6003, kEvent},
       {kBase + kPeriod + 2, kBase + 4094, kBase + kPeriod + 3}},
      {"a TIME_HIGH is damaged, and seems ahead",
       {0x6064, kEvent, 0x8206, 0x6002, kEvent, 0x8007, 0x6001, kEvent, 0x8008, 0x6003, kEvent},
       {kBase + 100, (5 + 0x201) * kPeriod + 2, kBase + 2 * kPeriod + 1, kBase + 3 * kPeriod + 3}},
      {"the time wraps after a silence of 16.7 s",
       {0x6064, kEvent, 0x8003, 0x6064, kEvent},
       {kBase + 100, (4096 + 3) * kPeriod + 100}},
      {"the time wraps within 4 us, long after a silence",
       {0x6064, kEvent, 0x8fff, 0x8fff, 0x8fff, 0x8fff, 0x8fff, 0x8fff,
        0x8fff, 0x8fff, 0x8fff, 0x8fff, 0x8fff, 0x8fff, 0x8fff, 0x8fff,
        0x8fff, 0x8fff, 0x8fff, 0x6ffe, kEvent, 0x8000, 0x6002, kEvent},
       {kBase + 100, 4096 * kPeriod - 2, 4096 * kPeriod + 2}},
  };
  for (const Case& one : cases) {
    EvtDecoder decoder(EvtEncoding::kEvt3);
    EXPECT_THAT(decoded(decoder, evt3Words({0x8005, 0x0000})), IsEmpty());
    EXPECT_EQ(timesOf(decoded(decoder, evt3Words(one.words))), one.times_us) << one.what;
  }
}

TEST(EvtDecoder, AfterAGapNothingIsDeliveredUntilTimeAndRowAreKnown) {
  EvtDecoder decoder(EvtEncoding::kEvt3);
  EXPECT_THAT(timesOf(decoded(decoder, evt3Words({0x8fff, 0x6001, 0x0000, 0x2000}))),
              ElementsAre(4095 * 4096 + 1));
  decoder.skipGap();
  EXPECT_THAT(timesOf(decoded(decoder, evt3Words({0x2000, 0x6002, 0x0000, 0x2000, 0x8001, 0x2000,
                                                  0x6000, 0x2000, 0x0000, 0x2000}))),
              ElementsAre(4097 * 4096, 4097 * 4096));
  decoder.reset();
  EXPECT_THAT(timesOf(decoded(decoder, evt3Words({0x2000, 0x8001, 0x6000, 0x0000, 0x2000}))),
              ElementsAre(4096));
}

TEST(EvtDecoder, Evt2TimeWrapsAndMayStepBack) {
  std::string bytes;
  for (const std::uint32_t word :
       {0x8fff'ffffU, 0U, 0x8000'0000U, 0U, 0x8fff'fff0U, 0U, 0x8000'0001U, 0U, 0x8600'0000U, 0U}) {
    putWord(bytes, word);
  }
  constexpr std::int64_t kWrap = std::int64_t{1} << 34;
  EXPECT_THAT(
      timesOf(decoded(EvtEncoding::kEvt2, bytes)),
      ElementsAre(kWrap - 64, kWrap, kWrap - 16 * 64, kWrap + 64, kWrap + 0x600'0000 * 64LL));
}

/// Returns events of a sensor of 2048x2048 pixels: rows with several events, pauses of up to 10 s.
std::vector<Event> randomEvents() {
  std::vector<Event> events;
  std::int64_t t_us = *rc::gen::inRange<std::int64_t>(0, 16'000'000);
  const int rows = *rc::gen::inRange(1, 60);
  for (int row = 0; row < rows; ++row) {
    if (row > 0) t_us += *rc::gen::element<std::int64_t>(0, 1, 3, 1'000, 4'096, 4'097, 10'000'000);
    auto x = *rc::gen::inRange<unsigned>(0, 1'900);
    const auto y = *rc::gen::inRange<std::uint16_t>(0, 2'048);
    const bool polarity = *rc::gen::arbitrary<bool>();
    const int count = *rc::gen::inRange(1, 12);
    for (int i = 0; i < count; ++i) {
      events.push_back({t_us * 1'000, static_cast<std::uint16_t>(x), y, polarity});
      x += *rc::gen::inRange<unsigned>(1, 12);
    }
  }
  return events;
}

RC_GTEST_PROP(EvtDecoderProperty, EncodedEventsAreDecodedWhereverTheStreamIsDivided, ()) {
  const auto encoding = *rc::gen::element(EvtEncoding::kEvt2, EvtEncoding::kEvt21,
                                          EvtEncoding::kEvt21Legacy, EvtEncoding::kEvt3);
  const std::vector<Event> events = randomEvents();
  const std::string bytes = evtBytes(encoding, events);
  EvtDecoder decoder(encoding);
  std::vector<Event> read;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t size = std::min(*rc::gen::inRange<std::size_t>(1, 200), bytes.size() - at);
    decoder.decode(reinterpret_cast<const std::uint8_t*>(bytes.data()) + at, size, read);
    at += size;
  }
  RC_ASSERT(read == events);
  RC_ASSERT(decoder.incompleteBytes() == 0U);
  RC_ASSERT(decoder.undatedEvents() == 0U);
}

RC_GTEST_PROP(EvtDecoderProperty, AfterAScanTheTimesAreTheSame, ()) {
  const auto encoding =
      *rc::gen::element(EvtEncoding::kEvt2, EvtEncoding::kEvt21Legacy, EvtEncoding::kEvt3);
  const std::vector<Event> events = randomEvents();
  const std::string bytes = evtBytes(encoding, events);
  const std::size_t scanned = *rc::gen::inRange<std::size_t>(0, bytes.size());
  EvtDecoder decoder(encoding);
  decoder.scanTime(reinterpret_cast<const std::uint8_t*>(bytes.data()), scanned);
  const std::vector<Event> read = decoded(decoder, bytes.substr(scanned));
  RC_ASSERT(read.size() <= events.size());
  RC_ASSERT(std::equal(read.rbegin(), read.rend(), events.rbegin()));
}

}  // namespace
}  // namespace efm
