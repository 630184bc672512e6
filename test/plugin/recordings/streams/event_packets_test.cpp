// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/streams/event_packets.h"
#include "plugin/recordings/streams/time_unit.h"
#include "plugin/recordings/text/event_text.h"
#include "test/plugin/recordings/streams/reading.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::int64_t kMs = 1'000'000;

/// A stream of given blocks. The data after the blocks are damaged.
class ListedStream : public EventStream {
 public:
  using Blocks = std::vector<std::vector<Event>>;
  ListedStream(Blocks blocks, std::int64_t& sought_ns)
      : blocks_(std::move(blocks)), sought_ns_(sought_ns) {}
  bool decode(std::vector<Event>& events) override {
    events.clear();
    if (next_ == blocks_.size()) throw std::runtime_error("damaged");
    events = blocks_[next_++];
    return true;
  }
  void seek(std::int64_t t_ns) override { sought_ns_ = t_ns; }
  std::string positionOf(std::size_t index) const override {
    return "block " + std::to_string(next_) + ", event " + std::to_string(index);
  }
  std::string name() const override { return "list"; }
  double progress() const override { return 0; }

 private:
  Blocks blocks_;
  std::int64_t& sought_ns_;
  std::size_t next_ = 0;
};

std::vector<std::int64_t> timesOf(const std::vector<Event>& events) {
  std::vector<std::int64_t> times_ns;
  for (const Event& event : events) times_ns.push_back(event.t_ns);
  return times_ns;
}

TEST(EventPackets, AnIntervalIsReadAsFarAsLateEventsOfItMayCome) {
  constexpr std::int64_t kBegin = 5 * kMs;
  constexpr std::int64_t kEnd = 20 * kMs;
  const std::int64_t last = kEnd + kMaxEventDelayNs - 1;
  for (const bool whole : {true, false}) {
    std::int64_t sought_ns = 0;
    ListedStream::Blocks blocks = {{{kBegin - 1}, {kBegin}}, {{kEnd}, {last}}, {{kEnd - 1}}};
    if (whole) blocks.push_back({{last + 1}, {-kMs}});  // events after `last` are not read
    EventPackets packets(std::make_unique<ListedStream>(blocks, sought_ns), {1, 1});
    packets.startAt(kBegin);
    packets.stopAt(kEnd);
    EXPECT_EQ(sought_ns, kBegin - kMaxEventDelayNs);
    EXPECT_THAT(timesOf(packets.nextPacket().all()), ElementsAre(kBegin));
    EXPECT_THAT(timesOf(packets.nextPacket().all()), ElementsAre(kEnd - 1));
    EXPECT_EQ(packets.nextTime(), whole ? std::nullopt : std::optional(last));
    EXPECT_EQ(packets.isAtDamage(), !whole);
    EXPECT_THAT(packets.nextPacket(), IsEmpty());
    EXPECT_EQ(packets.damage(), whole ? "" : "damaged");
    EXPECT_EQ(packets.sortedEvents(), 1U);
  }
}

TEST(EventPackets, ArePeriodsOfTheGridAroundZero) {
  struct Case {
    std::int64_t period_ns;
    std::vector<std::vector<std::int64_t>> packets;
  };
  for (const auto& [period_ns, expected] :
       std::vector<Case>{{kPacketPeriodNs, {{-1}, {0, 7, 9'999'999}, {10'000'000}, {7'123 * kMs}}},
                         {7, {{-14, -8}, {-7, -1}, {0, 6}, {7, 13}, {700}}}}) {
    std::vector<Event> all;
    for (const auto& packet : expected) {
      for (const std::int64_t t_ns : packet) all.push_back({t_ns});
    }
    std::int64_t unused_ns = 0;
    EventPackets packets(std::make_unique<ListedStream>(ListedStream::Blocks{all}, unused_ns),
                         {1, 1}, period_ns);
    for (const auto& packet : expected) {
      EXPECT_EQ(packets.nextTime(), packet.front());
      EXPECT_EQ(timesOf(packets.nextPacket().all()), packet);
    }
    EXPECT_EQ(packets.nextTime(), all.back().t_ns) << "the newest before the damage";
    EXPECT_THAT(packets.nextPacket(), IsEmpty());
    EXPECT_EQ(packets.damage(), "damaged");
  }
  EXPECT_THAT(messageOf([] { EventPackets(nullptr, {1, 1}, 0); }), HasSubstr("packet period (ns)"));
}

TEST(EventPackets, AnEventBesideTheSensorOrBeyondTheEndOfTimeIsAnError) {
  const struct {
    Event event;
    const char* error;
  } rows[] = {
      {{0, 299, 7, true}, "damaged"},  // a valid event
      {{0, 300, 7, true},
       "block 1, event 2: x = '300': expected a whole number from 0 to 299 (the sensor "
       "has 300x8 pixels; are x and y in this order"},
      {{0, 299, 8, true},
       "block 1, event 2: y = '8': expected a whole number from 0 to 7 (the sensor has "
       "300x8 pixels"},
      {{kEndOfTimeNs - 1, 0, 0, true}, "damaged"},
      {{kEndOfTimeNs, 0, 0, true},
       "block 1, event 2: t = '4611686018427387903': expected a time in"},
      {{-1 - kMaxEventDelayNs, 0, 0, true},
       "t = '-0.010000001': expected events in time order, at"},
  };
  for (const auto& [event, expected] : rows) {
    std::int64_t unused_ns = 0;
    EventPackets packets(std::make_unique<ListedStream>(
                             ListedStream::Blocks{{Event{0}, Event{0}, event}}, unused_ns),
                         {300, 8});
    EXPECT_THAT(errorOf([&] { readPackets(packets); }), HasSubstr(expected));
  }
  std::int64_t unused_ns = 0;
  EventPackets none(std::make_unique<ListedStream>(ListedStream::Blocks{}, unused_ns), {1, 1});
  EXPECT_EQ(none.nextTime(), -kEndOfTimeNs) << "there is no event before it";
  EXPECT_TRUE(none.isAtDamage());
}

TEST(EventPackets, OfOneTimeAreDividedAndUntilThenItIsNotComplete) {
  const std::vector<Event> all(kMaxPacketEvents + 5, Event{7});
  std::int64_t unused_ns = 0;
  EventPackets packets(
      std::make_unique<ListedStream>(ListedStream::Blocks{all, {{7 + 30 * kMs}}}, unused_ns),
      {1280, 720});
  EXPECT_EQ(packets.nextPacket().size(), kMaxPacketEvents);
  EXPECT_EQ(packets.nextTime(), 7);
  EXPECT_EQ(packets.nextPacket().size(), 5U);
  EXPECT_EQ(packets.nextTime(), 7 + 30 * kMs);
}

TEST(EventPackets, MoreThanFourEventsAPixelAtOneTimeAreAnErrorOfAllTimes) {
  for (const int count : {8, 9}) {
    std::int64_t unused_ns = 0;
    const auto events = static_cast<std::size_t>(count);
    EventPackets packets(std::make_unique<ListedStream>(
                             ListedStream::Blocks{std::vector<Event>(events, {kMs})}, unused_ns),
                         {2, 1});
    BadEvents bad(100);
    packets.skipBadEvents(bad);
    EXPECT_THAT(errorOf([&] { readPackets(packets); }),
                HasSubstr(count == 8 ? "damaged"
                                     : "block 1, event 8: t = '0.001000000': 9 events have this "
                                       "time, over 4 a pixel: expected times that differ"));
    EXPECT_EQ(bad.count(), 0U);
  }
}

/// A stream of given blocks. The file ends after the blocks.
class EndingStream : public ListedStream {
 public:
  using ListedStream::ListedStream;
  bool decode(std::vector<Event>& events) override {
    try {
      return ListedStream::decode(events);
    } catch (const std::runtime_error&) {
      return false;
    }
  }
};

TEST(EventPackets, EventsAheadOfBothNeighboursAreTheBadOnes) {
  const struct {
    std::vector<int> times_ms;
    std::vector<int> good_ms;
    std::optional<int> stop_ms{};
    const char* error =
        "expected a time near those of the events beside it, of which the one "
        "before is at 0.001000000";
  } rows[] = {
      {{0, 1, 100'000, 2, 3}, {0, 1, 2, 3}},
      {{0, 1, 100'000, 2}, {0, 1, 2}, 50, nullptr},  // it is outside the interval
      {{0, 1, 100'000}, {0, 1}},                     // the last event is bad
      {{0, 1, 100'000}, {0, 1}, 50, nullptr},        // the last event is outside the interval
      {{0, 1, 9'000}, {0, 1, 9'000}, {}, nullptr},   // the last event may be noise after a pause
      {{0, 1, 500, 2}, {0, 1, 2}},
      {{0, 1, 12, 2}, {0, 1, 2, 12}, {}, nullptr},
      {{0, 1, 13, 2}, {0, 1, 2}},
      {{0, 1, 100'000, 100'001, 2, 3, 4}, {0, 1, 2, 3, 4}},
      {{100'000, 0, 1},
       {0, 1},
       {},
       "'100.000000000': expected a time near those of the events after"},
      {{-100'000, 0, 1, 101}, {0, 1, 101}, {}, "'-100.000000000': expected a time near"},
      {{0, 1, 5'000, 4'990, 5'001}, {0, 1, 4'990, 5'000, 5'001}, {}, nullptr},  // a pause
      {{0, 1, 5'000, 9'000, 13'000}, {0, 1, 5'000, 9'000, 13'000}, {}, nullptr},
      {{1'000, 5'000, 0, 5'001}, {1'000, 5'000, 5'001}, {}, "the newest (5.000000000)"},
  };
  for (const bool blocks : {true, false}) {
    for (const auto& [times_ms, good_ms, stop_ms, error] : rows) {
      ListedStream::Blocks of_one;
      for (const int t_ms : times_ms) of_one.push_back({{t_ms * kMs}});
      ListedStream::Blocks all = {{}};
      for (const auto& block : of_one) all.front().push_back(block.front());
      std::vector<std::int64_t> expected;
      for (const int t_ms : good_ms) expected.push_back(t_ms * kMs);
      std::int64_t unused_ns = 0;
      EventPackets packets(std::make_unique<EndingStream>(blocks ? of_one : all, unused_ns),
                           {1, 1});
      BadEvents bad(2);
      packets.skipBadEvents(bad);
      if (stop_ms) packets.stopAt(*stop_ms * kMs);
      EXPECT_EQ(timesOf(readPackets(packets)), expected);
      EXPECT_EQ(bad.count(), error == nullptr ? 0U : times_ms.size() - good_ms.size());
      EXPECT_THAT(bad.first(), HasSubstr(error == nullptr ? "" : error));
    }
  }
}

class PacketsOfText : public TemporaryFolder {};

TEST_F(PacketsOfText, AnIntervalHasItsEventsInOrderThoughTheyComeLate) {
  constexpr int kEvents = 100'000;  // one event per 10 µs: several blocks of text
  std::mt19937 random(1);
  std::vector<std::pair<std::int64_t, int>> order;  // order of arrival, up to 9.9 ms late
  for (int i = 0; i < kEvents; ++i) {
    order.emplace_back(i * 10'000 + static_cast<std::int64_t>(random() % (99 * kMs / 10)), i);
  }
  std::sort(order.begin(), order.end());
  std::string lines;
  for (const auto& [arrival_ns, i] : order) {
    const std::string number = std::to_string(i * 10);
    lines += "0." + std::string(6 - number.size(), '0') + number + " " + std::to_string(i % 300) +
             " 7 1\n";
  }
  writeFile(folder() / "events.txt", lines);
  for (const auto& [first, end] : {std::pair(0, kEvents), std::pair(30'100, 30'200),
                                   std::pair(50'000, 73'000), std::pair(99'500, kEvents)}) {
    EventPackets packets(std::make_unique<EventTextStream>(folder() / "events.txt"), {300, 8});
    packets.startAt(first == 0 ? -5 * kMs : first * std::int64_t{10'000});
    packets.stopAt(end * std::int64_t{10'000});
    std::vector<Event> expected;
    for (int i = first; i < end; ++i) {
      expected.push_back({i * std::int64_t{10'000}, static_cast<std::uint16_t>(i % 300), 7, true});
    }
    EXPECT_TRUE(readPackets(packets) == expected) << first;
  }
}

TEST_F(PacketsOfText, BadEventsAreLeftOutUpToTheLimitOfAllCameras) {
  std::string good;  // of 100 events, one may be late
  for (int i = 0; i < 97; ++i) good += "0.1 1 2 0\n";
  good += "0.2 3 4 1\n0.2 3 4 1\n";
  const std::string bad = "0.2 3 4\nnan 3 4 1\n0.2 300 4 1\n0.2 3 8 1\n0.18 3 4 1\n";
  for (const char* name : {"cam0.txt", "cam1.txt"}) {
    writeFile(folder() / name, good + bad + "0.3 5 6 0\n0.4 5");
  }
  const auto read_both = [&](BadEvents& events) {
    std::size_t count = 0;
    for (const char* name : {"cam0.txt", "cam1.txt"}) {
      EventPackets packets(std::make_unique<EventTextStream>(folder() / name), {300, 8});
      packets.skipBadEvents(events);
      count += readPackets(packets).size();
    }
    return count;
  };
  BadEvents twelve(12);
  EXPECT_EQ(read_both(twelve), 200U);
  EXPECT_EQ(twelve.count(), 12U);
  EXPECT_THAT(twelve.first(), HasSubstr("cam0.txt:100: '0.2 3 4': expected 4 fields"));
  BadEvents eleven(11);
  EXPECT_THAT(errorOf([&] { read_both(eleven); }),
              AllOf(HasSubstr("cam1.txt:104: t = '0.18"),
                    HasSubstr("(11 bad events before it were left out")));
  BadEvents none(0);
  EXPECT_THAT(
      errorOf([&] { read_both(none); }),
      AllOf(HasSubstr("cam0.txt:100: "), HasSubstr("(--skip-bad-events N leaves out up to N")));
}

TEST_F(PacketsOfText, ManyLateEventsAreAnErrorThatSortsTheFile) {
  std::vector<std::pair<double, std::string>> events;  // pictures of 30 ms, each by column
  for (int i = 0; i < 3000; ++i) events.emplace_back(5 + 1e-4 * i, fmt::format("{} 7 1", i % 300));
  std::vector<std::pair<double, std::string>> disordered = events;
  for (int i = 0; i < 3000; i += 300) std::reverse(&disordered[i], &disordered[i] + 300);
  for (const auto& [name, separator, header] :
       {std::tuple("a.txt", " ", ""), std::tuple("a.csv", ",", "t,x,y,p\n")}) {
    const auto textOf = [&, sep = std::string(separator),
                         head = std::string(header)](const auto& all) {
      std::string text = head;
      for (auto [t_s, rest] : all) {
        std::replace(rest.begin(), rest.end(), ' ', sep[0]);
        text += fmt::format("{:.6f}{}{}\n", t_s, sep, rest);
      }
      return text;
    };
    const auto read = [&](const char* file, std::uint64_t limit) {
      BadEvents bad(limit);
      EventPackets packets(std::make_unique<EventTextStream>(folder() / file), {300, 8});
      packets.skipBadEvents(bad);
      return readPackets(packets);
    };
    writeFile(folder() / "sorted", textOf(events));
    const std::vector<Event> all = read("sorted", 0);
    writeFile(folder() / name, textOf(disordered));
    for (const std::uint64_t limit : {0U, 100'000U}) {
      const std::string error = errorOf([&] { read(name, limit); });
      EXPECT_THAT(error, HasSubstr(name));
      EXPECT_THAT(error, HasSubstr("events are over 10 ms late"));
      const std::size_t begin = error.find("this sorts them: ") + 17;
      std::string command = error.substr(begin, error.find(">NEW") + 4 - begin);
      for (std::size_t at; (at = command.find("FILE")) != std::string::npos;) {
        command.replace(at, 4, (folder() / name).string());
      }
      command.replace(command.find("NEW"), 3, (folder() / "new").string());
      ASSERT_EQ(std::system(("bash -c \"" + command + "\"").c_str()), 0) << command;
      EXPECT_TRUE(read("new", 0) == all) << command;
    }
    // Late events one by one: more and less than 1 %.
    for (const int late : {29, 31}) {
      std::vector<std::pair<double, std::string>> some = events;
      for (int i = 0; i < late; ++i) some[1500 + 2 * i].first -= 0.1;
      writeFile(folder() / name, textOf(some));
      if (late == 29) {
        EXPECT_EQ(read(name, 1000).size(), 2971U);
      } else {
        EXPECT_THAT(errorOf([&] { read(name, 1000); }), HasSubstr("31 of 3000 events"));
      }
    }
  }
}

// A damaged time word dates a burst of events. Of any stream, exactly the burst is left out.
RC_GTEST_PROP(EventPackets, ABurstOfWrongTimesIsLeftOut, ()) {
  constexpr std::int64_t kSecond = 1'000 * kMs;
  const std::int64_t period_ns =
      *rc::gen::element<std::int64_t>(200, 1'000, 20'000, 500'000, 20'000'000);
  // Of 20 ms on, events are confirmed.
  const auto longest = std::clamp<std::int64_t>(15 * kMs / period_ns, 1, 5'000);
  const auto length = *rc::gen::inRange<std::int64_t>(1, longest + 1);
  // Enough events that are right, on the sides that the burst has.
  const std::int64_t side = 2 * std::max<std::int64_t>(2'000, length) + 25 * kMs / period_ns;
  const auto at = *rc::gen::element<std::int64_t>(0, side, 2 * side);
  const bool ahead = *rc::gen::arbitrary<bool>();
  // Beyond a margin, so that the order shows it, at the ends beyond a long pause.
  const bool hides = ahead ? at == 2 * side : at == 0;
  const std::int64_t shift_ns = *rc::gen::inRange<std::int64_t>(
      hides ? 11 * kSecond : side * period_ns + 11 * kMs, 400'000 * kSecond);
  const std::int64_t first_ns =
      *rc::gen::element<std::int64_t>(0, -5 * kSecond, 1'700'000'000 * kSecond);
  std::vector<Event> good, all;
  for (std::int64_t i = 0; i < 2 * side + length; ++i) {
    Event event{first_ns + i * period_ns, static_cast<std::uint16_t>(i % 300)};
    const bool wrong = i >= at && i < at + length;
    if (!wrong) good.push_back(event);
    if (wrong) event.t_ns += ahead ? shift_ns : -shift_ns;
    all.push_back(event);
  }
  ListedStream::Blocks blocks(1);
  const auto block = *rc::gen::element<std::size_t>(1, 7, 4'096, 1'000'000);
  for (const Event& event : all) {
    if (blocks.back().size() == block) blocks.emplace_back();
    blocks.back().push_back(event);
  }
  std::int64_t unused_ns = 0;
  EventPackets packets(std::make_unique<EndingStream>(blocks, unused_ns), {300, 1});
  BadEvents bad(all.size());
  packets.skipBadEvents(bad);
  const bool same = readPackets(packets) == good;  // not printed: long
  RC_ASSERT(same);
  RC_ASSERT(bad.count() == static_cast<std::uint64_t>(length));
}

/// Returns `count` times from `first` on. A negative step gives falling times.
TimeSample sampleOf(int count, double first, double step) {
  TimeSample sample;
  for (int i = 0; i < count; ++i) sample.add(first + i * step);
  sample.add(NAN);  // ignored
  return sample;
}

TEST(TimeUnit, IsThatOfTheOptionOrOfTheValuesWhereTheyLeaveNoDoubt) {
  constexpr double kYear2000Us = 946'684'800e6;
  constexpr double kYear2050Us = 2'524'608'000e6;
  constexpr double kEndOfTimeUs = 4'611'686'018'427'388;
  const char* const none = ": expected decimal seconds, or --time-unit s, ms, us or ns";
  const struct {
    int count;
    double first;
    double step;
    int exponent;
    const char* error;  // null if there is no error
    bool warned = false;
  } rows[] = {
      {0, 0, 0, 0, nullptr},
      {9, 5, 10, 0, nullptr},
      {10, 5, 10, 0,
       "in e: all times are whole numbers, of an unknown unit: probably us, where 10"},
      {2000, 25'000, -10, 0, "probably us, where 2000 events take 0.02 s: expected --time-unit us"},
      {2000, 5, 100, 0, "probably us"},  // of the possible common units the middle one
      {2000, 5, 10'000, 0, "probably ns"},
      {2000, 5, 1'000'000'000, 0, none},
      {20, 5, 0, 0, none},
      {2000, 1.7e15, 10, -6, nullptr, true},
      {2000, 1.7e12, 1, 0, "all times are whole numbers"},  // in the present era, but too rare
      {2000, kYear2000Us - 19'990, 10, -6, nullptr, true},
      {2000, kYear2000Us - 20'000, 10, 0, "all times are whole numbers"},
      {2000, kYear2050Us - 20'000, 10, -6, nullptr, true},
      {2000, kYear2050Us - 19'990, 10, 0, "all times are whole numbers"},
      {2000, kEndOfTimeUs - 1999, 1, -9, nullptr},
      {2000, kEndOfTimeUs - 2000, 1, 0, "all times are whole numbers"},
      {2000, -1.7e18, 1e4, -9, nullptr},
      {2000, 0.5, 1e-5, 0, nullptr},
      {2000, 0.5, 0, 0, nullptr},
      {1000, 0.5, 33.28 / 999, 0, nullptr},  // 30 events per second
      {1000, 0.5, 33.32 / 999, 0,
       "in e: 1000 events from 0.5 on take 33.3 of a unit that is not seconds: probably ms"},
      {999, 0.5, 1.0 / 29, 0, nullptr},
      {5, 4.6e9 + 0.5, 1, 0, nullptr},
      {5, 4.7e9 + 0.5, 1, 0, "not seconds"},
      {2000, 16'384.5, 1.0 / 512, 0,
       "in e: the times are float32 numbers, which are 0.00195 s apart at 16388.40"},
      {2000, 16'384.5, 1.0 / 1024, 0, nullptr},
      {2000, 8'192.5, 1.0 / 1024, 0, nullptr},
      {2000, 1.7e9, 0, 0, "are 128 s apart at 1700000000: expected float64"},
      {2000, 1.7e15F, 0, 0, "are 134 s apart at 16999999"},
  };
  for (const auto& row : rows) {
    SCOPED_TRACE(testing::Message() << row.count << " from " << row.first << " by " << row.step);
    const TimeSample sample = sampleOf(row.count, row.first, row.step);
    ASSERT_EQ(sample.count, row.count);
    TimeUnit unit;
    const std::string error =
        errorOf([&] { unit = findTimeUnit({}, sample, kUsualEventRate, "in e"); });
    EXPECT_THAT(error, HasSubstr(row.error != nullptr ? row.error : "no error"));
    EXPECT_EQ(unit.exponent, row.exponent);
    ASSERT_EQ(unit.warning.has_value(), row.warned);
    EXPECT_THAT(unit.warning.value_or(Warning()).text,
                HasSubstr(row.warned ? "(--time-unit us)" : ""));
    for (const int exponent : {0, -3, -6, -9}) {
      const ReaderOptions told{{}, {}, timeUnitOf(exponent)};
      EXPECT_EQ(findTimeUnit(told, sample, kUsualEventRate, "").exponent, exponent);
    }
  }
}

TEST(TimeUnit, OfPosesIsNotConcludedFromTheirValues) {
  EXPECT_THAT(errorOf([] { poseTimeExponent({}, sampleOf(12, 928'218, 1), "p"); }),
              HasSubstr("p: all times are whole numbers, of an unknown unit: probably ms, where 12 "
                        "poses take 0.011 s"));
  EXPECT_THAT(errorOf([] { poseTimeExponent({}, sampleOf(12, 1.7e15, 10'000), "p"); }),
              HasSubstr("p: the times are whole numbers without a unit; as us"));
  EXPECT_EQ(poseTimeExponent({}, sampleOf(12, 1.7e18, 1e7), ""), -9);
}

TEST(TimeUnit, HasNames) {
  const struct {
    int exponent;
    std::int64_t unit_ns;
    const char* names;
  } rows[] = {
      {0, 1'000'000'000, "s sec secs second seconds"},
      {-3, 1'000'000, "ms msec msecs millisecond milliseconds"},
      {-6, 1'000, "us \u00b5s \u03bcs usec usecs microsecond microseconds"},
      {-9, 1, "ns nsec nsecs nanosecond nanoseconds"},
  };
  for (const auto& row : rows) {
    EXPECT_EQ(nanosecondsPer(row.exponent), row.unit_ns);
    for (const std::string_view name : splitWords(row.names)) {
      EXPECT_EQ(timeExponentOf(name), row.exponent) << name;
    }
  }
  EXPECT_EQ(timeExponentOf("m"), std::nullopt);
}

}  // namespace

}  // namespace efm
