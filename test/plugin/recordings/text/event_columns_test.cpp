// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/open/recording_formats.h"
#include "plugin/recordings/text/event_columns.h"
#include "plugin/recordings/text/event_text.h"
#include "test/plugin/recordings/columns/zip_file.h"
#include "test/plugin/recordings/streams/reading.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

/// A function of the event's number i: its time, column, row or polarity.
using Values = std::function<double(int)>;
struct Recorded {
  Values t = [](int i) { return 1 + i * 1e-5; };
  Values x = [](int i) { return i * 97 % 240; };
  Values y = [](int i) { return i * 59 % 180; };
  Values p = [](int i) { return i % 3 == 0 ? 1 : 0; };
};

/// Returns the order that values in the columns x y t p show: "xytp!" if the order is certain.
std::string shownBy(const Recorded& recorded, int count = 200,
                    const std::string& expected = "txyp") {
  EventRows rows = {{1, 2, 3}};  // a row without four numbers
  for (int i = 0; i < count; ++i) {
    rows.push_back({recorded.x(i), recorded.y(i), recorded.t(i), recorded.p(i)});
  }
  const std::optional<ColumnOrder> found = orderOfValues(rows, expected);
  return found ? found->order + (found->certain ? "!" : "") : "";
}

TEST(ColumnOrder, IsThatOfTheOnlyPossibleColumns) {
  const auto with = [](Values Recorded::*column, const Values& values) {
    Recorded recorded;
    recorded.*column = values;
    return recorded;
  };
  EXPECT_EQ(shownBy({}), "xytp!");
  EXPECT_EQ(shownBy({}, 9), "");
  EXPECT_EQ(shownBy({}, 10), "xytp");
  EXPECT_EQ(shownBy({}, 99), "xytp");
  EXPECT_EQ(shownBy({}, 100), "xytp!");
  EXPECT_EQ(shownBy(with(&Recorded::p, [](int) { return 1; })), "xytp");
  EXPECT_EQ(shownBy(with(&Recorded::p, [](int) { return 0; })), "xytp");
  EXPECT_EQ(shownBy(with(&Recorded::p, [](int i) { return i % 2 * 2 - 1; })), "xytp!");
  EXPECT_EQ(shownBy(with(&Recorded::p, [](int i) { return -(i % 2); })), "");
  EXPECT_EQ(shownBy(with(&Recorded::p, [](int i) { return i % 3; })), "");
  EXPECT_EQ(shownBy(with(&Recorded::p, [](int i) { return 0.5 * (i % 3); })), "");
  // A time may be late by a tenth of the whole duration at most.
  EXPECT_EQ(shownBy(with(&Recorded::t, [](int i) { return i == 101 ? 90 : i; }), 102), "xytp!");
  EXPECT_EQ(shownBy(with(&Recorded::t, [](int i) { return i == 101 ? 89 : i; }), 102), "");
  EXPECT_EQ(shownBy(with(&Recorded::t, [](int) { return 0.5; })), "");
  // Pixels are whole, at least 0, have 16 bits, and span 2 or more.
  for (const auto& column : {&Recorded::x, &Recorded::y}) {
    for (const auto& [least, most, order] :
         {std::tuple(0.0, 65'535.0, "xytp!"), std::tuple(3.0, 5.0, "xytp!"),
          std::tuple(0.0, 65'536.0, ""), std::tuple(-1.0, 9.0, ""), std::tuple(0.5, 9.0, ""),
          std::tuple(3.0, 4.0, "")}) {
      const auto pixels = [least = least, most = most](int i) { return i % 2 == 0 ? most : least; };
      EXPECT_EQ(shownBy(with(column, pixels)), order) << least << " to " << most;
    }
  }
}

TEST(ColumnOrder, IsTheExpectedOneWhereItIsPossible) {
  for (const char* expected : {"xytp", "yxtp"}) {
    EXPECT_EQ(shownBy({}, 10, expected), std::string(expected) + "!");
  }
  Recorded still;  // one pixel, one polarity, one time
  still.t = still.x = still.y = [](int) { return 7; };
  still.p = [](int) { return 1; };
  EXPECT_EQ(shownBy(still, 200, "xytp"), "xytp!");
  Recorded restarted;  // times with decimals may fall
  restarted.t = [](int i) { return i % 100 + 0.5; };
  EXPECT_EQ(shownBy(restarted, 200, "xytp"), "xytp!");
  restarted.t = [](int i) { return i % 100; };
  EXPECT_EQ(shownBy(restarted, 200, "xytp"), "");
  EXPECT_EQ(shownBy({}, 200, "xytp-"), "xytp!") << "another number of columns";
}

}  // namespace

// Tests text events in other layouts than t x y p.

namespace {

using testing::AllOf;
using testing::HasSubstr;

class EventColumnsText : public TemporaryFolder {
 protected:
  std::filesystem::path write(const std::string& text, const char* name = "e.txt") const {
    writeFile(folder() / name, text);
    return folder() / name;
  }
  std::string errorOfText(const std::string& text, const ReaderOptions& options = {}) const {
    return errorOf([&] {
      EventTextStream stream(write(text), options);
      readStream(stream);
    });
  }
};

TEST_F(EventColumnsText, OrderUnitAndPolarityAreThoseOfTheHeaderOrTheOptions) {
  const std::vector<Event> expected = {{1'000'000, 12, 34, true}, {2'001'000, 239, 0, false}};
  const struct {
    const char* text;
    const char* columns;
    const char* time_unit;
  } rows[] = {
      {"0.001 12 34 1\n0.002001 239 0 -1\n", "", ""},
      {"240 180\n0.001 12 34 1\n0.002001 239 0 0\n", "", ""},
      {"t,x,y,p\n0.001,12,34,1\n0.002001,239,0,0\n", "", ""},
      {"x,y,pol,timestamp_us\r\n12,34,1,1000\r\n239,0,0,2001\r\n", "", ""},
      {"# x [px], y [px], p, t [us]\n12, 34, 1, 1000\n239 ,0, -1, 2001\n", "", ""},
      {"frame;polarity;x;y;time (ns)\n7;1;12;34;1000000\n8;0;239;0;2001000\n", "", ""},
      {"# recorded on Monday\nevents of camera\n0.001 12 34 1\n0.002001 239 0 0\n", "", ""},
      {"12 34 0.001 1\n239 0 0.002001 0\n", "x y t p", ""},
      {"12 34 9 1 1\n239 0 9 2.001 -1\n", "x,y,-,t,p", "ms"},
      {"1000 12 34 1\n2001 239 0 0\n", "", "us"},
      {"1000000\t12  34 1\n2001000 239 0 0 # late\n", "", "ns"},
      {"1.0 12 34 1\n2.001 239 0 0", "", "ms"},
      {"\xEF\xBB\xBF"
       "0.001 12 34 1\n0.002001 239 0 -1\n",
       "", ""},
      {"\xEF\xBB\xBFt;x;y;p\n0.001;12;34;1\n0.002001;239;0;0\n", "", ""},
      {"% t x y p\n0.001 12 34 1\n0.002001 239 0 0\n", "", ""},
      {"0.001 12.0 34. 1.00\n0.002001 239 0.0 0.0\n", "", ""},
      {"1e-3 1.2e+01 34 1e0\n2.001e-03 2.39e2 0e+00 -1.0\n", "", ""},
      {"0.001 12 34 True\n0.002001 239 0 false\n", "", ""},
      {"0.001,12,34,ON\n0.002001,239,0,Off\n", "", ""},
      {"12 34 1 0.001 left\r\n239 0 0 0.002001 left\r\n", "x y p t -", ""},
      {",x,y,polarity,ts\n0,12,34,True,0.001\n1,239,0,False,0.002001\n", "", ""},
      {"x_pos,y_pos,polarity,time_us\n12,34,1,1000\n239,0,0,2001\n", "", ""},
      {"row,col,on_off,microseconds\n34,12,1,1000\n0,239,0,2001\n", "", ""},
      {"Timestamp(us) U V Sign\n1000 12 34 1\n2001 239 0 -1\n", "", ""},
      {"time [milliseconds];y;x;p\n1;34;12;1\n2.001;0;239;0\n", "", ""},
  };
  for (const auto& row : rows) {
    const ReaderOptions options{{}, row.columns, row.time_unit};
    EventTextStream stream(write(row.text), options);
    EXPECT_TRUE(looksLikeEventText(folder() / "e.txt", options)) << row.text;
    const std::vector<Event> events = readStream(stream);
    EXPECT_TRUE(events == expected) << row.text << events.size();
  }
  EventTextStream sized(write("240 180\n0.001 12 34 1\n"));
  ASSERT_TRUE(sized.size());
  EXPECT_EQ(sized.size()->width, 240);
  EXPECT_EQ(sized.size()->height, 180);
}

/// Returns events as a sensor makes them, in any order and unit.
/// @param format of a line with the fields {t}, {x}, {y} and {p}.
/// @param start and step of the times, in the unit.
std::string linesOf(const std::string& format, int count, double start, double step, int decimals) {
  std::string text;
  for (int i = 0; i < count; ++i) {
    text += fmt::format(format + "\n",
                        fmt::arg("t", fmt::format("{:.{}f}", start + i * step, decimals)),
                        fmt::arg("x", i * 97 % 240), fmt::arg("y", i * 59 % 180),
                        fmt::arg("p", i * 7 % 3 == 0 ? 1 : 0));
  }
  return text;
}

TEST_F(EventColumnsText, TheOrderThatTheValuesShowIsUsedAndSaid) {
  const std::string usual = linesOf("{t} {x} {y} {p}", 200, 1, 1e-5, 6);
  EventTextStream expected(write(usual, "usual.txt"));
  EXPECT_THAT(expected.warnings(), testing::IsEmpty());
  const std::vector<Event> events = readStream(expected);
  ASSERT_EQ(events.size(), 200U);
  EventTextStream stream(write(linesOf("{x} {y} {p} {t}", 200, 1, 1e-5, 6)));
  EXPECT_TRUE(readStream(stream) == events);
  ASSERT_THAT(stream.warnings(), testing::SizeIs(1));
  EXPECT_EQ(stream.warnings()[0].name, "event-columns");
  EXPECT_THAT(stream.warnings()[0].text, HasSubstr("--event-columns \"x y p t\""));
  EXPECT_THAT(
      errorOfText(linesOf("{x} {y} {p} {t}", 20, 1, 1e-5, 6)),
      HasSubstr("e.txt: by their values, the columns are probably x y p t: expected t x y"));
  EXPECT_THAT(errorOfText(usual, ReaderOptions{{}, "x y t p", {}}),
              AllOf(HasSubstr("--event-columns 'x y t p'"), HasSubstr("e.txt are t x y p by")));
  EventTextStream swapped(write(usual), ReaderOptions{{}, "t y x p", {}});  // possible
  EXPECT_EQ(readStream(swapped).at(1).y, events.at(1).x);
  EventTextStream named(write("a,b,c,d\n" + linesOf("{t},{x},{y},{p}", 200, 1, 1e-5, 6)));
  ASSERT_THAT(named.warnings(), testing::SizeIs(1));
  EXPECT_THAT(named.warnings()[0].text, HasSubstr("the header 'a,b,c,d' is not understood"));
}

TEST_F(EventColumnsText, TheUnitIsToldInTheHeaderOrFoundFromTheValues) {
  const std::string dated = linesOf("{t} {x} {y} {p}", 2000, 1.7e15, 10, 0);
  EventTextStream stream(write(dated));
  EXPECT_EQ(readStream(stream).at(1).t_ns, 1'700'000'000'000'010'000);
  ASSERT_THAT(stream.warnings(), testing::SizeIs(1));
  EXPECT_EQ(stream.warnings()[0].name, "time-unit");
  EventTextStream header(write("t_ns x y p\n" + dated));
  EXPECT_EQ(readStream(header).at(1).t_ns, 1'700'000'000'000'010);
  EventTextStream told(write("t_ns x y p\n5 1 2 0\n"), ReaderOptions{{}, {}, "ms"});
  EXPECT_EQ(readStream(told).at(0).t_ns, 5'000'000) << "the option comes before the header";
  EXPECT_THAT(told.warnings(), testing::IsEmpty());
  const ReaderOptions seconds{{}, {}, "s"};
  for (const std::string sign : {"", "-"}) {
    EventTextStream end(write(sign + "4611686018.427387902 1 2 0\n"), seconds);
    EXPECT_EQ(std::abs(readStream(end).at(0).t_ns), kEndOfTimeNs - 1);
    EXPECT_THAT(errorOfText(sign + "4611686018.427387903 1 2 0\n", seconds),
                HasSubstr("e.txt:1: t = '" + sign + "4611686018.427387903': expected a time"));
  }
  EXPECT_THAT(errorOfText(linesOf("{t} {x} {y} {p}", 12, 5, 10, 0)),
              HasSubstr("e.txt: all times are whole numbers"));
}

TEST_F(EventColumnsText, AnErrorNamesTheLineTheColumnAndTheOption) {
  EXPECT_THAT(errorOfText("t,x,y,p\n0.1,1,2,0\n0.2,1,,0\n"), HasSubstr("e.txt:3: y = ''"));
  EXPECT_THAT(errorOfText("x y t p\n1 2 a 0\n"), HasSubstr("e.txt:2: t = 'a': expected a time"));
  EXPECT_THAT(errorOfText("1 2 1 0.5\n"), HasSubstr("--event-columns"));
  EXPECT_THAT(errorOfText("t x y p\n0.1 1.5 2 0\n"),
              HasSubstr("x = '1.5': expected a whole number from 0 to 65535; rectified events"));
  EXPECT_THAT(errorOfText("0.1 1 2 0\n240 180\n"), HasSubstr("e.txt:2: '240 180': expected 4"));
  for (const char* wrong : {"x y t", "x y t p p", "x y t q", "t x y p z"}) {
    EXPECT_THAT(errorOfText("0.1 1 2 0\n", ReaderOptions{{}, wrong, {}}),
                AllOf(HasSubstr("--event-columns"), HasSubstr(wrong)));
  }
}

std::string manyLines(int count) {
  std::string text;
  for (int i = 0; i < count; ++i) {
    text += formatSeconds(1'000'000'000 + i * 2000 - i % 2 * 9'000'000) + " " +
            std::to_string(i % 240) + (i % 2 == 0 ? " 7 1\n" : " 7 ON\n");
  }
  return text;
}

TEST_F(EventColumnsText, CompressedTextHasTheEventsOfTheText) {
  const std::string text = manyLines(100'000);
  EventTextStream plain(write(text));
  const std::vector<Event> expected = readStream(plain);
  ASSERT_EQ(expected.size(), 100'000U);
  writeGzip(folder() / "events.txt.gz", text);
  writeZip(folder() / "events.zip", {{"events.txt", text}});
  for (const char* name : {"events.txt.gz", "events.zip"}) {
    EventTextStream stream(folder() / name);
    stream.seek(1'500'000'000);
    EXPECT_TRUE(readStream(stream) == expected) << name;
    EXPECT_NEAR(stream.progress(), 1, 0.01) << name;
    ASSERT_NE(detectFormat(folder() / name), nullptr) << name;
    EXPECT_EQ(detectFormat(folder() / name)->name, "text") << name;
  }
  const std::string xz(
      "\3757zXZ\0\0\0\377\022\331A\002\0!\001\014\0\0\0\217\230A\234\001\0\011"
      "1.5 2 3 1\n\0\0\0\0\001\032\n\356\246~p\006r\236z\001\0\0\0\0\0YZ",
      60);
  EventTextStream one(write(xz, "events.txt.xz"));
  EXPECT_EQ(readStream(one), (std::vector<Event>{{1'500'000'000, 2, 3, true}}));
  std::filesystem::resize_file(folder() / "events.txt.gz",
                               std::filesystem::file_size(folder() / "events.txt.gz") / 2);
  EXPECT_THAT(errorOf([&] {
                EventTextStream stream(folder() / "events.txt.gz");
                readStream(stream);
              }),
              HasSubstr("events.txt.gz: cannot be unpacked to its end"));
}

TEST_F(EventColumnsText, SeekingLeavesOutNothingAndReadsLittle) {
  std::string text = manyLines(200'000);  // 0.4 s in 4 MB; every second event is late
  text += "# the end\n4.999900000 1 1 0\n5.000100000 2 2 0\n4.995 3 3 0\n5.0002 4 4 0\n";
  const std::filesystem::path file = write(text);
  EventTextStream whole(file);
  const std::vector<Event> all = readStream(whole);
  for (const std::int64_t t_ns : {-1'000'000'000L, 1'000'000'000L, 1'100'010'000L, 1'234'567'000L,
                                  1'300'000'000L, 5'000'050'000L, 9'000'000'000L}) {
    EventTextStream stream(file);
    stream.seek(t_ns);
    const std::vector<Event> found = readStream(stream);
    ASSERT_LE(found.size(), all.size()) << t_ns;
    const auto left_out = static_cast<std::ptrdiff_t>(all.size() - found.size());
    EXPECT_TRUE(std::equal(found.begin(), found.end(), all.begin() + left_out)) << t_ns;
    for (auto event = all.begin(); event != all.begin() + left_out; ++event) {
      ASSERT_LT(event->t_ns, t_ns) << t_ns;
    }
    const auto needed = std::count_if(all.begin(), all.end(),
                                      [&](const Event& event) { return event.t_ns >= t_ns; });
    EXPECT_LT(static_cast<std::ptrdiff_t>(found.size()) - needed, 10'000) << t_ns;
  }
  writeFile(file, text + "5.1 1 2\n");
  EventTextStream damaged(file);
  damaged.seek(4'000'000'000);
  EXPECT_THAT(errorOf([&] { readStream(damaged); }),
              AllOf(HasSubstr("e.txt: line "), HasSubstr(" after byte "), HasSubstr("'5.1 1 2'")));
}

TEST_F(EventColumnsText, OnlyLinesOfEventsAreEventText) {
  const struct {
    const char* text;
    bool is;
  } rows[] = {{"0.1 1 2 0\n", true},
              {"240 180\n0.1 1 2 0\n", true},
              {"x,y,p,t\n1,2,0,0.5\n", true},
              {"# a\n0.1,1,2,0\n", true},
              {"", false},
              {"1 0 0 0 0 0 0 1\n", false},
              {"hello world\n", false},
              {"{\"a\": 1}\n", false},
              {"200 200 120 90 0 0 0 0 0\n", false}};
  for (const auto& row : rows) {
    EXPECT_EQ(looksLikeEventText(write(row.text)), row.is) << row.text;
  }
  EXPECT_FALSE(looksLikeEventText(folder()));
  EXPECT_FALSE(looksLikeEventText(folder() / "nowhere"));
  EXPECT_FALSE(looksLikeEventText(write(std::string("0.1 1 2 0\n\0", 11))));
}

}  // namespace

}  // namespace efm
