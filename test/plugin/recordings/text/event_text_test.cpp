// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/text/event_text.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <rapidcheck/gtest.h>
#include <algorithm>
#include <map>
#include <random>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/streams/event_packets.h"
#include "test/plugin/recordings/streams/reading.h"
#include "test/plugin/temporary_folder.h"
#include "tracking_stub/truth/dataset_writer.h"

namespace efm {

// GoogleTest looks for this operator in the namespace of Event.
static std::ostream& operator<<(std::ostream& stream, const Event& event) {
  return stream << formatSeconds(event.t_ns) << " " << event.x << " " << event.y << " "
                << event.polarity;
}

namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

EventPackets open(const std::filesystem::path& file) {
  return EventPackets(std::make_unique<EventTextStream>(file), {240, 180});
}

class EventText : public TemporaryFolder {
 protected:
  std::filesystem::path file() const { return folder() / "events.txt"; }

  std::vector<Event> read(const std::string& text) const {
    writeFile(file(), text);
    EventPackets reader = open(file());
    return readPackets(reader);
  }
  std::string errorOfText(const std::string& text) const {
    return errorOf([&] { read(text); });
  }
  /// Returns the beginning of an error about a line.
  std::string line(int number) const { return file().string() + ":" + std::to_string(number); }
};

TEST_F(EventText, LinesHaveTimePixelAndPolarity) {
  using Events = std::vector<Event>;
  const std::pair<const char*, Events> rows[] = {
      {"0.003811000 96 133 0\n0.003820001 127 171 1\n",
       {{3'811'000, 96, 133, false}, {3'820'001, 127, 171, true}}},
      {"1700000000.123456789 0 0 1\n1700000000.123456790 0 0 1\n",
       {{1'700'000'000'123'456'789, 0, 0, true}, {1'700'000'000'123'456'790, 0, 0, true}}},
      {"-1.5 0 0 0\n-0 0 0 0\n.5 0 0 0\n1 0 0 0\n1. 0 0 0\n1.25 0 0 0\n1.3333333336 0 0 0\n"
       "1.5e0 0 0 0\n00000000002.0 0 0 0\n",
       {{-1'500'000'000},
        {0},
        {500'000'000},
        {1'000'000'000},
        {1'000'000'000},
        {1'250'000'000},
        {1'333'333'334},
        {1'500'000'000},
        {2'000'000'000}}},
      {"# t x y p\r\n\r\n\n  0.1\t1  2\t 0 \r\n0.2 3 4 1\r\n0.3 5 6 0 # dust\n \t\n",
       {{100'000'000, 1, 2, false}, {200'000'000, 3, 4, true}, {300'000'000, 5, 6, false}}},
      {"0.1 000239 0000179 0\n0.2 3 4 1",
       {{100'000'000, 239, 179, false}, {200'000'000, 3, 4, true}}},
      {"", {}},
      {"# nothing\n\n", {}},
  };
  for (const auto& [text, events] : rows) EXPECT_EQ(read(text), events) << text;
}

TEST_F(EventText, WrongLinesAreErrorsThatNameTheLineTheValueAndTheExpectedOne) {
  struct Case {
    const char* text;
    int line;
    std::vector<std::string> parts;
  };
  const Case cases[] = {
      {"0.1 1 2 0\n0.2 3 4", 2, {"'0.2 3 4'", "expected t x y p", "the file ends within the line"}},
      {"0.", 1, {"the file ends"}},
      {"0.1 1 2 0\n\n0.2 3 1\n", 3, {"'0.2 3 1': expected 4 fields", "not 3"}},
      {"0.1 1 2 0\nabc 1 2 0\n", 2, {"t = 'abc': expected a time"}},
      {"0.1s 1 2 0\n", 1, {"t = '0.1s': expected a time"}},
      {"nan 1 2 0\n", 1, {"t = 'nan': expected a time"}},
      {"99999999999 1 2 0\n", 1, {"t = '99999999999': expected a time"}},
      {"0.1 1.5 2 0\n", 1, {"x = '1.5': expected a whole number"}},
      {"0.1 96.0 2 0\n0.2 96.5 2 0\n", 2, {"x = '96.5': expected a whole number"}},
      {"0.1 96.000001 2 0\n", 1, {"x = '96.000001': expected a whole number"}},
      {"0.1 1 2 0.5\n", 1, {"p = '0.5': expected polarity"}},
      {"0.1 1 0x2 0\n", 1, {"y = '0x2': expected a whole number"}},
      {"0.1 1 2 0\n0.1 240 2 0\n", 2, {"x = '240': expected", "0 to 239", "240x180"}},
      {"# a\n0.1 1 2 0\n# b\n\n0.1 1 2 0\n#\n0.1 240 2 0\n", 7, {"x = '240': expected"}},
      {"0.1 1 180 0\n", 1, {"y = '180': expected", "0 to 179", "240x180"}},
      {"0.1 -1 0 0\n", 1, {"x = '-1': expected"}},
      {"0.1 65536 0 0\n", 1, {"x = '65536': expected"}},
      {"0.1 4294967296 0 0\n", 1, {"x = '4294967296': expected"}},
      {"0.1 1 2 2\n", 1, {"p = '2'", "expected polarity 0 or 1"}},
      {"0.1 1 2 -0\n", 1, {"p = '-0'", "expected polarity 0 or 1"}},
      {"0.1 1 2 01\n", 1, {"p = '01'", "expected polarity 0 or 1"}},
      {"0.1 1 2 10\n", 1, {"p = '10'", "expected polarity 0 or 1"}},
      {"0.019 1 0 0\n0.020 1 0 0\n0.009999999 2 0 0\n",
       3,
       {"t = '0.009999999': expected", "at most 10 ms", "0.020000000"}}};
  for (const Case& wrong : cases) {
    const std::string error = errorOfText(wrong.text);
    EXPECT_THAT(error, StartsWith(line(wrong.line)));
    for (const std::string& part : wrong.parts) EXPECT_THAT(error, HasSubstr(part));
  }
}

TEST_F(EventText, AColumnWithTheCameraDividesAFile) {
  std::mt19937 random(3);
  const std::vector<std::vector<std::string>> names = {
      {"0", "1"}, {"2", "10", "7"}, {"left", "right"}, {"5"}};  // shares of 60,000
  for (const auto& cameras : names) {
    for (const bool one_after_the_other : {false, true}) {
      std::map<std::string, std::vector<Event>> expected;
      std::string text = "timestamp,x,y,polarity,camera_id\n";
      const std::size_t part = 60'000 / cameras.size();
      for (std::size_t i = 0; i < 60'000; ++i) {
        const std::size_t camera = one_after_the_other ? i / part : random() % cameras.size();
        const std::size_t step = one_after_the_other ? i % part : i;  // each begins anew
        const Event event = {static_cast<std::int64_t>(step) * 10'000,
                             static_cast<std::uint16_t>(i % 240), 5, i % 2 == 0};
        expected[cameras[camera]].push_back(event);
        text += fmt::format("{},{},5,{},{}\n", formatSeconds(event.t_ns), event.x,
                            event.polarity ? 1 : 0, cameras[camera]);
      }
      writeFile(folder() / "a.csv", text);
      auto streams = openEventText(folder() / "a.csv", {});
      ASSERT_EQ(streams.size(), cameras.size());
      std::vector<std::string> order = cameras;
      std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
        return std::make_pair(a.size(), a) < std::make_pair(b.size(), b);
      });
      for (std::size_t i = 0; i < streams.size(); ++i) {
        const std::vector<Event>& all = expected[order[i]];
        for (const std::size_t from : {std::size_t{0}, all.size() / 3, all.size() - 5}) {
          ReaderOptions options;
          EventPackets packets(std::move(openEventText(folder() / "a.csv", options)[i]),
                               {240, 180});
          packets.startAt(all[from].t_ns);
          const std::vector<Event> events = readPackets(packets);
          ASSERT_EQ(events,
                    std::vector<Event>(all.begin() + static_cast<std::ptrdiff_t>(from), all.end()))
              << order[i];
        }
      }
    }
  }
  // A line that is broken is one bad event, whoever it belongs to.
  writeFile(folder() / "a.csv", "t,x,y,p,cam\n0.1,1,1,1,0\n0.1,1,1\n0.2,1,1,1,1\n0.2,999,1,1,1\n");
  const auto expectTwoBad = [this](std::size_t good_of_each) {
    BadEvents bad(2);
    for (auto& stream : openEventText(folder() / "a.csv", {})) {
      EventPackets packets(std::move(stream), {240, 180});
      packets.skipBadEvents(bad);
      EXPECT_EQ(readPackets(packets).size(), good_of_each);
    }
    EXPECT_EQ(bad.count(), 2U);
  };
  expectTwoBad(1);
  // So is a line with a damaged name of the camera.
  std::string damaged = "t,x,y,p,cam\n";
  for (int i = 0; i < 4000; ++i) {
    damaged += fmt::format("{},1,1,1,{}\n", 1 + 0.001 * i,
                           i == 99    ? "x"
                           : i == 100 ? "7"
                           : i % 2    ? "1"
                                      : "0");
  }
  writeFile(folder() / "a.csv", damaged);
  ASSERT_EQ(openEventText(folder() / "a.csv", {}).size(), 2U);
  EXPECT_THAT(
      errorOf([&] {
        EventPackets packets(std::move(openEventText(folder() / "a.csv", {})[0]), {240, 180});
        BadEvents none(0);
        packets.skipBadEvents(none);
        readPackets(packets);
      }),
      HasSubstr("a.csv:101: camera = 'x': expected 0 or 1 (--skip-bad-events"));
  expectTwoBad(1999);
  ReaderOptions options;
  options.columns = "t x y p -";
  EXPECT_EQ(openEventText(folder() / "a.csv", options).size(), 1U) << "the user ignores it";
  std::string many = "t,x,y,p,cam\n";
  for (int i = 0; i < 70; ++i) many += fmt::format("0.{},1,1,1,{}\n", 100 + i, i);
  writeFile(folder() / "a.csv", many);
  EXPECT_THAT(errorOf([&] { openEventText(folder() / "a.csv", {}); }),
              HasSubstr("a.csv: column 5: over 64 cameras: expected"));
}

TEST_F(EventText, EventsAboveAWrongLineComeBeforeTheError) {
  std::vector<Event> events;
  for (std::int64_t i = 0; i < 5000; ++i) {  // 5 s of events; their disorder is sorted
    const std::int64_t late_ms = i % 7 == 0 ? 3 : 0;
    events.push_back({(i - late_ms) * 1'000'000, static_cast<std::uint16_t>(i % 240), 7, true});
  }
  writeEvents(file(), events);
  const std::string good = readText(file());
  std::stable_sort(events.begin(), events.end(),
                   [](const Event& a, const Event& b) { return a.t_ns < b.t_ns; });
  for (const std::string& bad :
       {std::string("garbage\n"), std::string("0.0 1 2 1\n"), std::string("5.1 1"),
        std::string("5.1 240 2 1\n5.2 1 2 1\n"), std::string(3 << 20, 'x')}) {
    writeFile(file(), good + bad);
    EventPackets reader = open(file());
    std::vector<Event> given;
    const std::string error = errorOf([&] {
      for (auto packet = reader.nextPacket(); !packet.empty(); packet = reader.nextPacket()) {
        given.insert(given.end(), packet.begin(), packet.end());
      }
      throw std::runtime_error(reader.damage());
    });
    EXPECT_TRUE(given == events) << given.size() << " of " << events.size() << " events";
    EXPECT_THAT(error, StartsWith(line(5001)));
  }
}

TEST_F(EventText, TheErrorOfABinaryFileHasNoControlCharacters) {
  EXPECT_THAT(errorOfText(std::string(3 << 20, '\x1b')),
              AllOf(StartsWith(line(1)), HasSubstr("\\x1b\\x1b"), HasSubstr("1048576 bytes"),
                    testing::Not(HasSubstr("\x1b"))));
}

/// Returns a file for properties, which have no fixture.
std::filesystem::path propertyFile() {
  return std::filesystem::temp_directory_path() /
         ("efm_event_text_" + std::to_string(getpid()) + ".txt");
}

RC_GTEST_PROP(EventTextProperty, WrittenEventsAreReadBackInTimeOrder, ()) {
  std::int64_t t_ns = *rc::gen::inRange<std::int64_t>(-1'000'000'000, 1'800'000'000'000'000'000);
  std::vector<Event> events;
  const int count = *rc::gen::inRange(1, 200);
  std::int64_t newest_ns = t_ns;
  std::uint64_t late = 0;
  for (int i = 0; i < count; ++i) {
    t_ns = newest_ns + *rc::gen::inRange<std::int64_t>(-kMaxEventDelayNs, 20'000'000);
    if (i == 0) newest_ns = t_ns;
    late += t_ns < newest_ns ? 1 : 0;
    newest_ns = std::max(newest_ns, t_ns);
    events.push_back({t_ns, *rc::gen::inRange<std::uint16_t>(0, 240),
                      *rc::gen::inRange<std::uint16_t>(0, 180), *rc::gen::arbitrary<bool>()});
  }
  writeEvents(propertyFile(), events);

  EventPackets reader = open(propertyFile());
  const std::vector<Event> read = readPackets(reader);
  std::filesystem::remove(propertyFile());

  std::stable_sort(events.begin(), events.end(),
                   [](const Event& a, const Event& b) { return a.t_ns < b.t_ns; });
  RC_ASSERT(read == events);
  RC_ASSERT(reader.sortedEvents() == late);
}

}  // namespace
}  // namespace efm
