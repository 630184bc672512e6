// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/sensors/aedat4.h"

#include <flatbuffers/flatbuffers.h>
#include <gmock/gmock.h>
#include <lz4frame.h>
#include <zstd.h>

#include <cstring>
#include <utility>

#include "plugin/recordings/open/recording_formats.h"
#include "test/plugin/recordings/streams/reading.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

using Packing = Aedat4Compression;

constexpr std::int64_t kStartUs = 1'600'000'000'000'000;

std::string textOf(const void* data, std::size_t size) {
  return {static_cast<const char*>(data), size};
}

std::string compressed(Packing compression, const std::string& bytes) {
  if (compression == Packing::kNone) return bytes;
  if (compression == Packing::kLz4 || compression == Packing::kLz4High) {
    std::string packed(LZ4F_compressFrameBound(bytes.size(), nullptr), '\0');
    packed.resize(
        LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr));
    return packed;
  }
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 1));
  return packed;
}

std::string finished(flatbuffers::FlatBufferBuilder& builder, flatbuffers::uoffset_t root,
                     const char* identifier) {
  builder.FinishSizePrefixed(flatbuffers::Offset<flatbuffers::Table>(root), identifier);
  return textOf(builder.GetBufferPointer(), builder.GetSize());
}

std::string eventPacket(const std::vector<Aedat4Event>& events) {
  flatbuffers::FlatBufferBuilder builder;
  const auto elements = builder.CreateVectorOfStructs(events);
  const auto table = builder.StartTable();
  builder.AddOffset(4, elements);
  return finished(builder, builder.EndTable(table), "EVTS");
}

/// Returns the same FlatBuffer with all values `skip` bytes later, as another writer aligns them.
std::string shifted(std::string bytes, std::uint32_t skip) {
  std::uint32_t number = 0;
  for (const std::size_t at : {std::size_t{0}, sizeof(number)}) {  // size, root's position
    std::memcpy(&number, &bytes[at], sizeof(number));
    number += skip;
    std::memcpy(&bytes[at], &number, sizeof(number));
  }
  return bytes.insert(12, skip, '\0');  // after the identifier
}

struct PacketInfo {
  std::int32_t stream;
  std::int32_t size;
};

struct Entry {
  std::int64_t byte;
  PacketInfo packet;
  std::int64_t count;
  std::int64_t first_us;
  std::int64_t last_us;
};

std::string indexOf(const std::vector<Entry>& entries) {
  flatbuffers::FlatBufferBuilder builder;
  std::vector<flatbuffers::Offset<flatbuffers::Table>> tables;
  for (const Entry& entry : entries) {
    const auto table = builder.StartTable();
    builder.AddElement(4, entry.byte, std::int64_t{0});
    builder.AddStruct(6, &entry.packet);
    builder.AddElement(8, entry.count, std::int64_t{0});
    builder.AddElement(10, entry.first_us, std::int64_t{0});
    builder.AddElement(12, entry.last_us, std::int64_t{0});
    tables.emplace_back(builder.EndTable(table));
  }
  const auto vector = builder.CreateVector(tables);
  const auto table = builder.StartTable();
  builder.AddOffset(4, vector);
  return finished(builder, builder.EndTable(table), "FTAB");
}

std::string headerOf(Packing compression, std::int64_t index, const std::string& xml,
                     std::uint32_t skip = 0) {
  flatbuffers::FlatBufferBuilder builder;
  builder.ForceDefaults(true);  // so the file's size is the same for every index
  const auto info = builder.CreateString(xml);
  const auto table = builder.StartTable();
  builder.AddElement(4, static_cast<std::int32_t>(compression), 0);
  builder.AddElement(6, index, std::int64_t{-1});
  builder.AddOffset(8, info);
  return "#!AER-DAT4.0\r\n" + shifted(finished(builder, builder.EndTable(table), "IOHE"), skip);
}

std::string streamXml(int id, const std::string& type, const std::string& source) {
  return "<node name=\"" + std::to_string(id) +
         "\"><attr key=\"originalOutputName\" type=\"string\">events</attr>"
         "<attr key=\"typeIdentifier\" type=\"string\">" +
         type +
         "</attr><node name=\"info\"><attr key=\"sizeX\" type=\"int\">640</attr>"
         "<attr key=\"sizeY\" type=\"int\">480</attr><attr key=\"source\" type=\"string\">" +
         source + "</attr></node></node>";
}

std::string outInfo(const std::string& streams) {
  return "<dv version=\"2.0\"><node name=\"outInfo\" path=\"/mainloop/Recorder/outInfo/\">" +
         streams + "</node></dv>";
}

/// Returns a recording. Streams 0 and 3 have events, other streams have other data. The list in the
/// file is not in order.
const std::string& twoCameras() {
  static const std::string xml = outInfo(
      streamXml(3, "EVTS", "right") + streamXml(1, "IMUS", "left") + streamXml(2, "FRME", "left") +
      streamXml(4, "TRIG", "left") + streamXml(0, "EVTS", "left"));
  return xml;
}

/// Returns packet k of a stream: 100 events in [k, k + 1) ms.
std::vector<Event> packetEvents(int stream, int packet) {
  std::vector<Event> events;
  for (int i = 0; i < 100; ++i) {
    events.push_back({(kStartUs + packet * 1000 + i * 10) * 1000, static_cast<std::uint16_t>(i),
                      static_cast<std::uint16_t>(stream * 100 + packet % 100), i % 3 == 0});
  }
  return events;
}

constexpr int kPackets = 40;

std::vector<Event> streamEvents(int stream, int first_packet = 0) {
  std::vector<Event> all;
  for (int packet = first_packet; packet < kPackets; ++packet) {
    for (const Event& event : packetEvents(stream, packet)) all.push_back(event);
  }
  return all;
}

std::string packetBytes(std::int32_t stream, const std::string& data) {
  const auto size = static_cast<std::int32_t>(data.size());
  return textOf(&stream, 4) + textOf(&size, 4) + data;
}

std::string recording(Packing compression, bool with_index, std::uint32_t skip = 0) {
  const std::string begin = headerOf(compression, -1, twoCameras(), skip);
  std::string packets;
  std::vector<Entry> entries;
  for (int packet = 0; packet < kPackets; ++packet) {
    for (const int stream : {0, 1, 2, 3, 4}) {
      std::vector<Aedat4Event> events;
      for (const Event& event : packetEvents(stream, packet)) {
        events.push_back({event.t_ns / 1000,
                          static_cast<std::int16_t>(event.x),
                          static_cast<std::int16_t>(event.y),
                          static_cast<std::uint8_t>(event.polarity),
                          {}});
      }
      const std::string data =
          compressed(compression, stream % 3 == 0 ? shifted(eventPacket(events), skip)
                                                  : "a FlatBuffer of another kind");
      entries.push_back({static_cast<std::int64_t>(begin.size() + packets.size() + 8),
                         {stream, static_cast<std::int32_t>(data.size())},
                         100,
                         events.front().t_us,
                         events.back().t_us});
      packets += packetBytes(stream, data);
    }
  }
  if (!with_index) return begin + packets;
  const auto index = static_cast<std::int64_t>(begin.size() + packets.size());
  return headerOf(compression, index, twoCameras(), skip) + packets +
         compressed(compression, shifted(indexOf(entries), skip));
}

class Aedat4 : public TemporaryFolder {
 protected:
  std::filesystem::path file() const { return folder() / "recording.aedat4"; }
  RecordingParts open(const ReaderOptions& options = {}) const {
    return openAedat4({file()}, options);
  }
  std::string errorOfBytes(const std::string& bytes) const {
    writeFile(file(), bytes);
    return errorOf([&] {
      RecordingParts parts = open();
      for (const auto& camera : parts.cameras) readStream(*camera);
    });
  }
};

TEST_F(Aedat4, EachStreamOfEventsIsACameraWhereverItsFlatBuffersAreAligned) {
  for (std::uint32_t skip = 0; skip < 8; ++skip) {
    const bool with_index = skip % 3 != 1;
    writeFile(file(), recording(static_cast<Packing>(skip % 5), with_index, skip));
    ASSERT_NE(detectFormat(file()), nullptr);
    EXPECT_EQ(detectFormat(file())->name, "aedat4");
    RecordingParts parts = open();
    ASSERT_EQ(parts.cameras.size(), 2U);
    EXPECT_EQ(parts.cameras[1]->size()->width, 640);
    EXPECT_EQ(parts.cameras[1]->size()->height, 480);
    EXPECT_TRUE(readStream(*parts.cameras[0]) == streamEvents(0)) << skip;
    EXPECT_EQ(parts.cameras[0]->progress(), 1);
    parts.cameras[1]->seek((kStartUs + 17'500) * 1000);
    EXPECT_TRUE(readStream(*parts.cameras[1]) == streamEvents(3, with_index ? 17 : 0)) << skip;
  }
}

TEST_F(Aedat4, EachPositionInAFlatBufferIsChecked) {
  const std::string good = eventPacket({{1, 2, 3, 1, {}}});
  ASSERT_EQ(good.size() % 4, 0U);
  const std::string header = headerOf(Packing::kNone, -1, outInfo(streamXml(0, "EVTS", "left")));
  std::size_t rejected = 0;
  // Makes each number of the buffer point beyond the end and before the beginning.
  for (std::size_t at = 0; at + 4 <= good.size(); at += 2) {
    for (const std::uint32_t wrong : {0x7fff'fff0U, 0xffff'fff0U, 0x8000'0000U}) {
      std::string damaged = good;
      std::memcpy(&damaged[at], &wrong, sizeof(wrong));
      if (errorOfBytes(header + packetBytes(0, damaged)) != "no error") ++rejected;
    }
  }
  EXPECT_GT(rejected, 20U);
}

TEST_F(Aedat4, StreamsAreChosenByCameraOutputOrNumber) {
  writeFile(file(), recording(Packing::kLz4, false));
  ReaderOptions options;
  options.topics = {"right", "0"};
  RecordingParts parts = open(options);
  ASSERT_EQ(parts.cameras.size(), 2U);
  EXPECT_TRUE(readStream(*parts.cameras[0]) == streamEvents(3));
  EXPECT_TRUE(readStream(*parts.cameras[1]) == streamEvents(0));
  options.topics = {"events"};
  EXPECT_EQ(open(options).cameras.size(), 2U);
  options.topics = {"middle"};
  EXPECT_THAT(errorOf([&] { open(options); }),
              AllOf(HasSubstr("no stream 'middle'"), HasSubstr("0 ('events' of 'left'), 3")));
}

TEST_F(Aedat4, TheSensorHas65535PixelsAtMost) {
  for (const auto& [side, known] : {std::pair("1", true), std::pair("65535", true),
                                    std::pair("0", false), std::pair("65536", false)}) {
    for (const char* other : {"640", "480"}) {
      const std::string xml = replaced(streamXml(0, "EVTS", "a"), other, side);
      writeFile(file(), headerOf(Packing::kNone, -1, outInfo(xml)));
      EXPECT_EQ(open().cameras.at(0)->size().has_value(), known) << side << " for " << other;
    }
  }
}

TEST_F(Aedat4, ASeekStartsAtThePacketOfItsTime) {
  writeFile(file(), recording(Packing::kZstd, true));
  for (const auto& [t_us, packet] : {std::pair<std::int64_t, int>{0, 0},
                                     {kStartUs, 0},
                                     {kStartUs + 17'500, 17},
                                     {kStartUs + 17'995, 18},
                                     {packetEvents(3, 17).back().t_ns / 1000, 17},
                                     {kStartUs + 90'000, kPackets}}) {
    RecordingParts parts = open();
    parts.cameras[1]->seek(t_us * 1000);
    EXPECT_TRUE(readStream(*parts.cameras[1]) == streamEvents(3, packet)) << t_us;
  }
  // If the index does not fit, all packets are read.
  std::string damaged = recording(Packing::kZstd, true);
  damaged[damaged.size() - 100] ^= 1;
  writeFile(file(), damaged);
  RecordingParts parts = open();
  parts.cameras[0]->seek((kStartUs + 17'500) * 1000);
  EXPECT_TRUE(readStream(*parts.cameras[0]) == streamEvents(0));
}

TEST_F(Aedat4, WrongDataAreErrorsThatNameTheirPosition) {
  const std::string good = recording(Packing::kLz4, false);
  const std::size_t packets = headerOf(Packing::kLz4, -1, twoCameras()).size();
  const auto with_packet = [&](Packing compression, const std::string& data) {
    return headerOf(compression, -1, twoCameras()) + packetBytes(0, data);
  };
  std::string wrong_size = good;
  wrong_size.replace(packets + 4, 4, "\xff\xff\xff\x7f");
  std::string huge_header = good;
  huge_header.replace(14, 4, "\xff\xff\xff\xff");
  struct Case {
    std::string bytes;
    std::vector<std::string> parts;
  };
  const std::string at_packet = "byte " + std::to_string(packets) + ": ";
  const std::vector<Case> cases = {
      {"#!AER-DAT3.1\r\n", {"byte 0: expected '#!AER-DAT4.0'"}},
      {good.substr(0, 16), {"byte 14: a header of", "up to the end"}},
      {huge_header, {"byte 14: a header of 4294967295 bytes: expected at most"}},
      {headerOf(static_cast<Packing>(9), -1, twoCameras()),
       {"byte 14: compression = 9: expected 0 (none), 1 or 2 (LZ4)"}},
      {headerOf(Packing::kNone, -1, "<dv><node"), {"expected XML"}},
      {headerOf(Packing::kNone, -1, "<dv/>"), {"no node 'outInfo'"}},
      {headerOf(Packing::kNone, -1, outInfo(streamXml(0, "FRME", "a"))), {"no stream of events"}},
      {headerOf(Packing::kNone, -1,
                outInfo(replaced(streamXml(0, "EVTS", "a"), "name=\"0\"", "name=\"a\""))),
       {"a stream of events: expected a number as its name"}},
      {wrong_size, {at_packet + "a packet of 2147483647 bytes: expected at most"}},
      {good.substr(0, good.size() - 1), {"a packet of", "expected at most"}},
      {with_packet(Packing::kLz4, "not a frame"), {at_packet, "expected an LZ4 frame"}},
      {with_packet(Packing::kZstd, "not a frame"), {at_packet, "Zstandard frame"}},
      {with_packet(Packing::kLz4, compressed(Packing::kLz4, eventPacket({{}})).substr(0, 30)),
       {at_packet, "compressed data of 30 bytes: expected more"}},
      {with_packet(Packing::kZstd, compressed(Packing::kZstd, std::string(300 << 20, '\0'))),
       {at_packet, "expected at most 256 MiB"}},
      {with_packet(Packing::kNone, eventPacket({{}}).substr(0, 40)),
       {at_packet, "expected a FlatBuffer 'EVTS'"}},
      {with_packet(Packing::kNone, eventPacket({{}, {INT64_MAX, 0, 0, 0, {}}})),
       {"packet at " + at_packet + "event 1: t = '9223372036854775807': expected a time"}}};
  for (const Case& wrong : cases) {
    const std::string error = errorOfBytes(wrong.bytes);
    EXPECT_THAT(error, StartsWith(file().string() + ": "));
    for (const std::string& part : wrong.parts) EXPECT_THAT(error, HasSubstr(part));
  }
  EXPECT_THAT(errorOf([&] { openAedat4({folder()}, {}); }), HasSubstr("cannot be opened"));
}

TEST_F(Aedat4, DamagedFilesAreReadOrRejected) {
  for (const auto compression : {Packing::kNone, Packing::kLz4, Packing::kZstd}) {
    readDamaged(recording(compression, true), file(), "aedat4");
  }
}

}  // namespace
}  // namespace efm
