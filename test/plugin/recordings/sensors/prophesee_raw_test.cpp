// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/sensors/prophesee_raw.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <memory>
#include <random>
#include <utility>

#include "mapping/base/number_bytes.h"
#include "plugin/recordings/open/recording_formats.h"
#include "test/paths.h"
#include "test/plugin/recordings/sensors/evt_words.h"
#include "test/plugin/recordings/streams/reading.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

struct RawKind {
  EvtEncoding encoding;
  std::string header;
};

const std::vector<RawKind>& rawKinds() {
  static const std::vector<RawKind> all = {
      {EvtEncoding::kEvt2, "% evt 2.0\n% geometry 640x480\n"},
      {EvtEncoding::kEvt21, "% format EVT21;height=480;width=640\n% end\n"},
      {EvtEncoding::kEvt21Legacy,
       "% evt 2.1\n% format EVT21;endianness=legacy;height=480;width=640\n% end\n"},
      {EvtEncoding::kEvt3,
       "% date 2023-03-29 16:37:46\n% evt 3.0\n"
       "% format EVT3;height=480;width=640\n% geometry 640x480\n% end\n"}};
  return all;
}

/// Returns 70 s of rows of several events, with pauses of up to 9 s. The clock of EVT 3.0 wraps.
std::vector<Event> longRecording() {
  std::mt19937 random(1);
  std::vector<Event> events;
  std::int64_t t_us = 5'000'000;
  while (t_us < 75'000'000) {
    t_us += random() % 40'000 == 0 ? 9'000'000 : random() % 1'800;
    const auto y = static_cast<std::uint16_t>(random() % 480);
    unsigned x = random() % 600;
    for (unsigned left = 1 + random() % 6; left > 0; --left, x += 1 + random() % 5) {
      events.push_back({t_us * 1000, static_cast<std::uint16_t>(x), y, (t_us & 1) != 0});
    }
  }
  return events;
}

std::unique_ptr<EventStream> streamOf(const std::filesystem::path& file) {
  return std::move(openPropheseeRaw({file}, {}).cameras.front());
}

class PropheseeRaw : public TemporaryFolder {
 protected:
  std::filesystem::path file() const { return folder() / "recording.raw"; }
};

TEST_F(PropheseeRaw, WithoutGeometryTheSizeIsThatOfTheCamera) {
  struct Case {
    std::string lines;
    int width;  // 0 if not known
    int height;
  };
  for (const Case& each : std::vector<Case>{
           {"% plugin_name hal_plugin_gen3_fx3\n% system_ID 21\n", 640, 480},
           {"% plugin_name hal_plugin_gen31_evk3\n", 640, 480},
           {"% plugin_name hal_plugin_gen4_evk2\n", 1280, 720},
           {"% plugin_name hal_plugin_gen41_evk3\n% system_ID 48\n", 1280, 720},
           {"% system_ID 21\n", 640, 480},
           {"% system_ID 48\n", 1280, 720},
           {"% system_ID 4\n", 0, 0},
           {"% system_ID 210\n", 0, 0},
           {"% plugin_name hal_plugin_gen5_evk4\n% system_ID 99\n", 0, 0},
           {"% plugin_name hal_plugin_gen42\n% serial_number 21\n", 0, 0},
           {"% system_ID 48\n% Version 7\n% geometry 320x240\n% plugin_name hal_plugin_gen3_fx3\n",
            320, 240}}) {
    writeFile(file(), "% Date 2020-09-25 07:48:31\n" + each.lines + "% evt 2.0\n");
    const std::optional<CameraSize> size = streamOf(file())->size();
    EXPECT_EQ(size.has_value(), each.width > 0) << each.lines;
    EXPECT_EQ(size.value_or(CameraSize{}).width, each.width) << each.lines;
    EXPECT_EQ(size.value_or(CameraSize{}).height, each.height) << each.lines;
  }
}

TEST_F(PropheseeRaw, DatHasAnEventInEightBytes) {
  const std::string header =
      "% Data file containing CD events.\n% Version 2\n% Date 2020-01-01 10:00:00\n% Height 720\n"
      "% Width 1280\n";
  std::string bytes = header + "\x0c\x08";
  std::vector<Event> events;
  // The 32 bits of the time wrap after 71.6 minutes; a late event does not.
  for (const std::int64_t t_us : {5LL, 1'500'000'000LL, 3'000'000'000LL, 4'294'967'290LL,
                                  4'294'967'300LL, 4'294'967'294LL, 6'000'000'000LL}) {
    const auto k = static_cast<std::uint16_t>(events.size());
    events.push_back({1000 * t_us, static_cast<std::uint16_t>(1279 - k),
                      static_cast<std::uint16_t>(719 - k), k % 2 == 0});
    appendLittleEndian(bytes, static_cast<std::uint32_t>(t_us));
    appendLittleEndian(bytes, static_cast<std::uint32_t>(events.back().x | events.back().y << 14 |
                                                         (k % 2 == 0 ? 1 : 0) << 28));
  }
  writeFile(file(), bytes);
  ASSERT_NE(detectFormat(file()), nullptr);
  EXPECT_EQ(detectFormat(file())->name, "raw");
  const auto stream = streamOf(file());
  ASSERT_TRUE(stream->size());
  EXPECT_EQ(stream->size()->width, 1280);
  EXPECT_EQ(stream->size()->height, 720);
  stream->seek(7'000'000'000'000);
  EXPECT_EQ(readStream(*stream), events);
  EXPECT_EQ(stream->undatedEvents(), 0U);
  const std::pair<std::string, const char*> errors[] = {
      {bytes.substr(0, bytes.size() - 3), "5 bytes of a word: expected all 8, but the file ends"},
      {replaced(bytes, "Version 2", "Version 1"), ":2: Version = '1': expected 2"},
      {replaced(bytes, "Height 720", "Height 0"), ":4: Height = '0': expected a number of pixels"},
      {header + "\x0e\x08", "the bytes '\\x0e\\x08' after the header: expected CD events"},
      {header, "the bytes '' after the header: expected CD events"}};
  for (const auto& [text, error] : errors) {
    writeFile(file(), text);
    EXPECT_THAT(errorOf([&] { readStream(*streamOf(file())); }), HasSubstr(error));
  }
}

TEST_F(PropheseeRaw, EachEncodingIsFoundByItsHeaderAndASeekLeavesOutMostBeforeItsTimeAlone) {
  const std::vector<Event> events = longRecording();
  for (const RawKind& kind : rawKinds()) {
    writeFile(file(), kind.header + evtBytes(kind.encoding, events));
    ASSERT_NE(detectFormat(file()), nullptr) << kind.header;
    EXPECT_EQ(detectFormat(file())->name, "raw");
    const double bytes_per_event = static_cast<double>(std::filesystem::file_size(file())) /
                                   static_cast<double>(events.size());
    for (const std::int64_t t_ns :
         {std::int64_t{-1}, std::int64_t{0}, std::int64_t{20'000'000'000},
          std::int64_t{33'554'432'000}, events.back().t_ns, std::int64_t{900'000'000'000}}) {
      const auto stream = streamOf(file());
      ASSERT_TRUE(stream->size()) << kind.header;
      EXPECT_EQ(stream->size()->width, 640);
      EXPECT_EQ(stream->size()->height, 480);
      stream->seek(t_ns);
      const std::vector<Event> read = readStream(*stream);
      EXPECT_EQ(stream->progress(), 1);
      const auto from = [&](const std::vector<Event>& all) {
        return std::vector<Event>(
            std::find_if(all.begin(), all.end(), [&](const Event& e) { return e.t_ns >= t_ns; }),
            all.end());
      };
      EXPECT_TRUE(from(read) == from(events)) << kind.header << t_ns;
      EXPECT_LT(static_cast<double>(read.size() - from(read).size()) * bytes_per_event,
                2.2 * 256 * 1024)
          << "two blocks";
    }
  }
}

TEST_F(PropheseeRaw, EventsBeforeTheFirstTimeAreCountedUnlessTheyLieBeforeTheSoughtTime) {
  writeFile(file(), "% evt 3.0\n" + evt3Words({0x0001, 0x2002, 0x2003, 0x8001, 0x6000, 0x2004}) +
                        evtBytes(EvtEncoding::kEvt3, longRecording()));
  const auto whole = streamOf(file());
  EXPECT_EQ(readStream(*whole).front().x, 4);
  EXPECT_EQ(whole->undatedEvents(), 2U);
  const auto end = streamOf(file());
  end->seek(20'000'000'000);
  readStream(*end);
  EXPECT_EQ(end->undatedEvents(), 0U);
}

TEST_F(PropheseeRaw, ThePositionOfAnEventIsThatOfItsWord) {
  const std::string header = "% evt 3.0\n";
  // The fourth word has one event, the sixth word two events.
  writeFile(file(), header + evt3Words({0x8001, 0x6000, 0x0005, 0x2001, 0x3000, 0x4003}));
  const auto stream = streamOf(file());
  std::vector<Event> events;
  ASSERT_TRUE(stream->read(events));
  ASSERT_EQ(events.size(), 3U);
  EXPECT_EQ(stream->positionOf(0), file().string() + ": byte 16");
  EXPECT_EQ(stream->positionOf(1), file().string() + ": byte 20");
  EXPECT_EQ(stream->positionOf(2), file().string() + ": byte 20");
}

TEST_F(PropheseeRaw, WordsThatBeginLikeALineAreNoHeader) {
  std::string words;  // a TIME_HIGH and an event: "% \1\x80\n\0\0\0"
  for (const std::uint32_t word : {0x8001'2025U, 0x0000'000aU}) putWord(words, word);
  writeFile(file(), "% evt 2.0\n" + words);
  const auto stream = streamOf(file());
  const std::vector<Event> events = readStream(*stream);
  ASSERT_EQ(events.size(), 1U);
  EXPECT_TRUE((events[0] == Event{0x1'2025 * 64'000LL, 0, 10, false}));
}

TEST_F(PropheseeRaw, AWrongHeaderIsAnErrorThatNamesItsLine) {
  struct Case {
    std::string header;
    std::vector<std::string> parts;
  };
  const std::vector<Case> cases = {
      {"% evt 4.0\n", {":1: evt = '4.0': expected 2.0, 2.1 or 3.0"}},
      {"% date x\n% format HISTO3D;height=1\n", {":2: format = 'HISTO3D': expected EVT2"}},
      {"% evt 3.0\n% geometry 640\n", {":2: geometry = '640': expected WIDTHxHEIGHT"}},
      {"% evt 3.0\n% geometry 0x480\n", {"geometry = '0x480'"}},
      {"% format EVT3;height=-1;width=2\n", {"height = '-1': expected", "1 to 65535"}},
      {"% evt 3.0\n% endianness big\n", {":2: endianness = 'big': expected little or legacy"}},
      {"% geometry 640x480\n", {": no encoding: expected", "% evt 3.0"}},
      {"", {": no encoding"}}};
  for (const Case& wrong : cases) {
    writeFile(file(), wrong.header);
    const std::string error = errorOf([&] { streamOf(file()); });
    EXPECT_THAT(error, StartsWith(file().string()));
    for (const std::string& part : wrong.parts) EXPECT_THAT(error, HasSubstr(part));
  }
  EXPECT_THAT(errorOf([&] { streamOf(folder()); }), HasSubstr("cannot be opened"));
}

TEST_F(PropheseeRaw, AnEndWithinAWordAndEventsWithoutTimeAreErrors) {
  writeFile(file(), "% evt 2.0\n" + std::string("\0\0\0\x80\1\2\3", 7));
  const auto cut = streamOf(file());
  EXPECT_THAT(errorOf([&] { readStream(*cut); }),
              AllOf(HasSubstr("byte 14: 3 bytes of a word"), HasSubstr("all 4")));
  writeFile(file(), "% evt 3.0\n" + evt3Words({0x0001, 0x2002, 0x2003}));
  const auto undated = streamOf(file());
  EXPECT_THAT(errorOf([&] { readStream(*undated); }),
              AllOf(HasSubstr("2 events without a time"), HasSubstr("TIME_HIGH")));
}

TEST_F(PropheseeRaw, OtherFilesAreNotTakenForIt) {
  for (const std::string text : {"", "% ", "0.1 1 2 1\n", "% no evt here\n"}) {
    writeFile(file(), text);
    EXPECT_FALSE(looksLikePropheseeRaw(file())) << text;
  }
  EXPECT_FALSE(looksLikePropheseeRaw(folder()));
  EXPECT_FALSE(looksLikePropheseeRaw(folder() / "absent"));
}

TEST_F(PropheseeRaw, DamagedFilesAreReadOrRejected) {
  std::vector<Event> events = longRecording();
  events.resize(2000);
  std::string dat =
      "% Data file containing CD events.\n% Version 2\n% Height 480\n% Width 640\n\x0c\x08";
  for (const Event& event : events) {
    appendLittleEndian(dat, static_cast<std::uint32_t>(event.t_ns / 1000));
    appendLittleEndian(dat, static_cast<std::uint32_t>(event.x | event.y << 14));
  }
  readDamaged(dat, file(), "raw");
  for (const RawKind& kind : rawKinds()) {
    readDamaged(kind.header + evtBytes(kind.encoding, events), file(), "raw");
  }
}

TEST_F(PropheseeRaw, ARealEvt2RecordingHasTheEventsThatNumPyFinds) {
  const std::filesystem::path real =
      std::filesystem::path(EFM_SHARED_DATA) / "raw_formats/faery_evt2.raw";
  if (!std::filesystem::exists(real)) GTEST_SKIP() << real << " is absent";
  const auto stream = streamOf(real);
  EXPECT_EQ(stream->size().value_or(CameraSize{}).height, 480) << "a camera of generation 3";
  const std::vector<Event> events = readStream(*stream);
  // Counted with numpy.frombuffer(…, '<u4') after the header's 166 bytes: words of type 0 and 1.
  // The time is 64 times the previous word of type 8, plus the bits 22 to 27.
  ASSERT_EQ(events.size(), 521'252U);
  std::int64_t on = 0;
  std::int64_t sum_us = 0;
  for (const Event& event : events) {
    on += event.polarity ? 1 : 0;
    sum_us += event.t_ns / 1000;
  }
  EXPECT_EQ(on, 185'861);
  EXPECT_EQ(events.front().t_ns, 913'716'224'000);
  EXPECT_EQ(events.back().t_ns, 913'812'095'000);
  EXPECT_EQ(sum_us, 476'298'094'656'969);
}

}  // namespace
}  // namespace efm
