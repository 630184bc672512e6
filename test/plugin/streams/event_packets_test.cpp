// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/streams/event_packets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "plugin/text/event_text.h"
#include "test/plugin/formats/files.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr int kEvents = 100'000;  // one each 10 us: several blocks of text

class PacketsOfText : public TemporaryFolder {
 protected:
  /// Lines of events, up to 9.9 ms late; `events` are in time order. Line `damaged` is damaged.
  std::string text(int damaged = -1) {
    std::mt19937 random(1);
    std::vector<std::pair<std::int64_t, int>> order;  // of arrival
    for (int i = 0; i < kEvents; ++i) {
      order.emplace_back(i * 10'000 + static_cast<std::int64_t>(random() % (99 * kMs / 10)), i);
    }
    std::sort(order.begin(), order.end());
    std::string lines;
    for (int line = 0; line < kEvents; ++line) {
      const int i = order[static_cast<std::size_t>(line)].second;
      const std::string number = std::to_string(i * 10);
      const std::string time = "0." + std::string(6 - number.size(), '0') + number;
      lines += (line == damaged ? "damaged" : time) + " " + std::to_string(i % 300) + " 7 1\n";
    }
    return lines;
  }
  std::vector<Event> read(std::int64_t from_ns, std::int64_t until_ns) {
    EventPackets packets(std::make_unique<EventTextStream>(folder() / "events.txt"), {300, 8});
    packets.startAt(from_ns);
    packets.stopAt(until_ns);
    std::vector<Event> all;
    for (auto packet = packets.nextPacket(); !packet.empty(); packet = packets.nextPacket()) {
      all.insert(all.end(), packet.begin(), packet.end());
    }
    return all;
  }
  static void expectAllBetween(std::int64_t from_ns, std::int64_t until_ns,
                               const std::vector<Event>& events) {
    const std::int64_t begin = std::max<std::int64_t>(from_ns, 0);
    const std::int64_t end = std::min<std::int64_t>(until_ns, kEvents * 10'000);
    ASSERT_EQ(events.size(), static_cast<std::size_t>((end - begin) / 10'000));
    for (std::size_t k = 0; k < events.size(); ++k) {
      const std::int64_t t_ns = begin + static_cast<std::int64_t>(k) * 10'000;
      ASSERT_EQ(events[k].t_ns, t_ns);
      ASSERT_EQ(events[k].x, t_ns / 10'000 % 300);
    }
  }
};

TEST_F(PacketsOfText, AnIntervalHasItsEventsInOrderThoughTheyComeLate) {
  writeFile(folder() / "events.txt", text());
  for (const auto& [from_ns, until_ns] :
       {std::pair(-5 * kMs, 2'000 * kMs), std::pair(301 * kMs, 302 * kMs),
        std::pair(500 * kMs, 730 * kMs), std::pair(995 * kMs, 1'000 * kMs)}) {
    expectAllBetween(from_ns, until_ns, read(from_ns, until_ns));
  }
}

TEST_F(PacketsOfText, DamageBehindAnIntervalIsNoError) {
  writeFile(folder() / "events.txt", text(32'500));  // at 325 ms, in the block of the interval
  expectAllBetween(290 * kMs, 300 * kMs, read(290 * kMs, 300 * kMs));
  EXPECT_THAT(errorOf([&] { read(290 * kMs, 330 * kMs); }), testing::HasSubstr("damaged"));
}

TEST_F(PacketsOfText, BadEventsAreLeftOutUpToTheLimitOfAllCameras) {
  const std::string good = "0.1 1 2 0\n0.2 3 4 1\n";
  const std::string bad = "0.2 3 4\nnan 3 4 1\n0.2 300 4 1\n0.2 3 8 1\n0.18 3 4 1\n";
  for (const char* name : {"cam0.txt", "cam1.txt"}) {
    writeFile(folder() / name, good + bad + "0.3 5 6 0\n0.4 5");
  }
  const auto readBoth = [&](BadEvents& events) {
    std::size_t count = 0;
    for (const char* name : {"cam0.txt", "cam1.txt"}) {
      EventPackets packets(std::make_unique<EventTextStream>(folder() / name), {300, 8});
      packets.skipBadEvents(events);
      for (auto packet = packets.nextPacket(); !packet.empty(); packet = packets.nextPacket()) {
        count += packet.size();
      }
    }
    return count;
  };
  BadEvents twelve(12);
  EXPECT_EQ(readBoth(twelve), 6U);
  EXPECT_EQ(twelve.count(), 12U);
  EXPECT_THAT(twelve.first(), testing::HasSubstr("cam0.txt:3: '0.2 3 4': expected 4 fields"));
  BadEvents eleven(11);
  EXPECT_THAT(errorOf([&] { readBoth(eleven); }),
              testing::AllOf(testing::HasSubstr("cam1.txt:7: t = '0.18"),
                             testing::HasSubstr("(11 bad events before it were left out")));
  BadEvents none(0);
  EXPECT_THAT(errorOf([&] { readBoth(none); }),
              testing::AllOf(testing::HasSubstr("cam0.txt:3: "),
                             testing::HasSubstr("(--skip-bad-events N leaves out up to N")));
}

}  // namespace
}  // namespace efm
