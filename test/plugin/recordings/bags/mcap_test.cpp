// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/bags/bag_recording.h"
#include "plugin/recordings/bags/bag_source.h"
#include "plugin/recordings/bags/mcap_records.h"
#include "plugin/recordings/open/open_recording.h"
#include "plugin/recordings/open/recording_formats.h"
#include "plugin/recordings/writers/recording_writer.h"
#include "test/plugin/recordings/bags/bag_bytes.h"
#include "test/plugin/recordings/bags/ros_message_bytes.h"
#include "test/plugin/recordings/streams/reading.h"
#include "test/plugin/temporary_folder.h"

namespace efm {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

constexpr std::int64_t kFirstNs = 1'700'000'000'000'000'123;

/// Tests a recording of 2 s of one camera in chunks of 1 MiB.
class Mcap : public TemporaryFolder {
 protected:
  Mcap() : file_(folder() / "recording.mcap") {
    CameraModel model{640, 480, 500, 501, 320.5, 240.5, DistortionModel::kEquidistant, {}};
    model.coefficients = {0.1, -0.2, 0.3, -0.4};
    rig_.cameras.push_back({model, {}, 0});
  }

  void write(int events_per_packet) {
    std::mt19937 random(1);
    events_.clear();
    const auto writer = openMcapWriter(file_, rig_);
    for (std::int64_t packet = 0; packet < 200; ++packet) {
      std::vector<Event> events;
      for (std::int64_t i = 0; i < events_per_packet; ++i) {
        events.push_back({kFirstNs + packet * 10'000'000 + i * 10'000'000 / events_per_packet,
                          static_cast<std::uint16_t>(random() % 640),
                          static_cast<std::uint16_t>(random() % 480), (random() & 1U) != 0});
      }
      writer->addEvents(0, events);
      writer->addPose({kFirstNs + packet * 10'000'000, T_world_rig_});
      events_.insert(events_.end(), events.begin(), events.end());
    }
    EXPECT_FALSE(std::filesystem::exists(file_)) << "before it is complete";
    writer->close();
  }
  RecordingParts open() const { return openBags({file_}, {}); }
  std::string errorOfBytes(const std::string& bytes) const {
    writeFile(file_, bytes);
    return errorOf([&] { readStream(*open().cameras.at(0)); });
  }

  std::filesystem::path file_;
  Rig rig_;
  Rigid3 T_world_rig_ = {Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5), {1.25, -2, 1.0 / 3}};
  std::vector<Event> events_;
};

TEST_F(Mcap, WhatIsWrittenIsReadBackAlsoWithoutASummary) {
  write(2'000);
  const std::string bytes = readText(file_);
  const std::size_t data_end = bytes.rfind(std::string("\x0f\4\0\0\0\0\0\0\0", 9));
  for (const std::string& file : {bytes, bytes.substr(0, data_end)}) {
    writeFile(file_, file);
    RecordingParts recording = open();
    ASSERT_EQ(recording.cameras.size(), 1U);
    EXPECT_TRUE(readStream(*recording.cameras[0]) == events_);
    ASSERT_EQ(recording.poses.size(), 200U);
    EXPECT_EQ(recording.poses[7].t_ns, kFirstNs + 70'000'000);
    EXPECT_TRUE(isSame(recording.poses[7].T_world_rig, T_world_rig_));
    EXPECT_EQ(recording.poses_damage, "");
    EXPECT_EQ(recording.calibration.value().rig.cameras.at(0).model, rig_.cameras[0].model);
  }
  EXPECT_THAT(errorOfBytes(bytes.substr(0, data_end) + std::string(100, '\0')),
              AllOf(HasSubstr(fmt::format("byte {}: ", data_end)), HasSubstr("may be cut off")))
      << "zeros are no records";
}

TEST_F(Mcap, LongPacketsAreDivided) {
  const auto writer = openMcapWriter(file_, rig_);
  std::vector<Event> events;
  for (std::int64_t i = 0; i < 300'000; ++i) events.push_back({kFirstNs + i * 40'000, 1, 2, true});
  writer->addEvents(0, events);  // 12 s of events
  writer->close();
  EXPECT_TRUE(readStream(*open().cameras.at(0)) == events);
}

TEST_F(Mcap, ValuesThatRosCannotHoldAreErrors) {
  const auto writer = openMcapWriter(file_, rig_);
  for (const auto& [event, expected] :
       {std::make_pair(Event{-1, 0, 0, true}, "expected 0 to 2147483647"),
        std::make_pair(Event{2'147'483'648'000'000'000, 0, 0, true}, "expected 0 to 2147483647"),
        std::make_pair(Event{0, 0, 0x8000, true}, "y = 32768: expected at most 32767")}) {
    EXPECT_THAT(errorOf([&, event = event] { writer->addEvents(0, {event}); }),
                AllOf(StartsWith(file_.string()), HasSubstr(expected)));
  }
  EXPECT_NO_THROW(writer->addEvents(0, {{2'147'483'647'999'999'999, 0x7FFF, 0x7FFF, true}}));
}

TEST_F(Mcap, OfACutFileWhatIsBeforeTheDamageIsRead) {
  write(2'000);
  const std::string bytes = readText(file_);
  const std::string half = bytes.substr(0, bytes.size() / 2);
  // The rest is missing, or is zeros because it was never written.
  for (const auto& [zeros, expected] : {std::make_pair(std::size_t{0}, "which may be cut off"),
                                        std::make_pair(bytes.size() / 2, "a damaged chunk")}) {
    writeFile(file_, half + std::string(zeros, '\0'));
    const RecordingParts recording = open();
    ASSERT_TRUE(recording.calibration);
    EXPECT_GT(recording.poses.size(), 50U);
    EXPECT_LT(recording.poses.size(), 150U);
    EXPECT_EQ(recording.poses.back().t_ns,
              kFirstNs + static_cast<std::int64_t>(recording.poses.size() - 1) * 10'000'000);
    std::vector<Event> read;
    std::vector<Event> block;
    const std::string damage = errorOf([&] {
      while (true) {
        const bool more = recording.cameras.at(0)->read(block);
        read.insert(read.end(), block.begin(), block.end());
        if (!more) throw std::runtime_error(recording.cameras.at(0)->damage());
      }
    });
    EXPECT_THAT(damage, AllOf(StartsWith(file_.string() + ": byte "), HasSubstr(expected),
                              HasSubstr("`mcap recover`")));
    EXPECT_EQ(recording.poses_damage, damage);
    // The messages of a chunk are in time order.
    EXPECT_NEAR(static_cast<double>(read.size()), 2e3 * static_cast<double>(recording.poses.size()),
                2e3);
    EXPECT_TRUE(std::equal(read.begin(), read.end(), events_.begin()));
    EXPECT_EQ(errorOf([&] { readPoses(file_, {}); }), damage) << "by --poses";
  }
  // Within the first chunk, no topic is known yet.
  EXPECT_THAT(errorOfBytes(bytes.substr(0, 5'000)), HasSubstr("which may be cut off"));
}

TEST_F(Mcap, DamageAmongThePosesIsToldAfterAllEvents) {
  write(200);
  const auto writer = openMcapWriter(file_, rig_);
  writer->addEvents(0, events_);
  for (std::int64_t i = 0; i < 20'000; ++i) {
    writer->addPose({kFirstNs + i * 100'000, T_world_rig_});  // the poses fill chunks of their own
  }
  writer->close();
  std::string bytes = readText(file_);
  const std::size_t data_end = bytes.rfind(std::string("\x0f\4\0\0\0\0\0\0\0", 9));
  bytes[bytes.rfind("zstd", data_end) + 1'000] ^= 1;
  writeFile(file_, bytes);

  RecordingSource source;
  source.files = {file_};
  const std::unique_ptr<Recording> recording = openRecording(source);
  std::size_t events = 0;
  std::size_t poses = 0;
  EXPECT_THAT(errorOf([&] {
                while (const auto sample = recording->next()) {
                  const auto* packet = std::get_if<EventPacket>(&*sample);
                  packet ? events += packet->events.size() : ++poses;
                }
              }),
              AllOf(StartsWith(file_.string() + ": byte "), HasSubstr("damaged")));
  EXPECT_EQ(events, events_.size());
  EXPECT_GT(poses, 5'000U);
  EXPECT_LT(poses, 20'000U);
}

TEST_F(Mcap, TheSummaryMayHaveAnyOrderAndNoChannels) {
  write(2'000);
  const std::string bytes = readText(file_);
  const std::size_t footer =
      bytes.size() - kMcapMagic.size() - kMcapFooterContent - kMcapRecordHead;
  const auto number_at = [&](std::size_t at) {
    std::uint64_t number = 0;
    std::memcpy(&number, bytes.data() + at, sizeof(number));
    return static_cast<std::size_t>(number);
  };
  const std::size_t begin = number_at(footer + kMcapRecordHead);
  std::string indexes;
  std::string others;
  for (std::size_t at = begin; at < footer;) {
    const std::string record = bytes.substr(at, kMcapRecordHead + number_at(at + 1));
    const bool is_index = static_cast<McapOp>(record[0]) == McapOp::kChunkIndex;
    (is_index ? indexes : others) += record;
    at += record.size();
  }
  const std::string no_checksum(4, '\0');
  const std::string end =
      bytes.substr(footer, kMcapRecordHead + 16) + no_checksum + std::string(kMcapMagic);
  for (const std::string& summary : {indexes + others, indexes}) {
    writeFile(file_, bytes.substr(0, begin) + summary + end);
    RecordingParts recording = open();
    ASSERT_EQ(recording.cameras.size(), 1U);
    EXPECT_TRUE(readStream(*recording.cameras[0]) == events_);
    EXPECT_EQ(recording.poses.size(), 200U);
  }
}

TEST_F(Mcap, DamagedDataHaveAnotherChecksum) {
  write(200);
  const std::string bytes = readText(file_);
  const std::size_t chunk = bytes.find(std::string("zstd")) + 4 + 8;
  const std::size_t summary = bytes.rfind("/cam0/events");
  for (const auto& [place, expected] :
       {std::make_pair(chunk + 20'000, "damaged"), std::make_pair(summary, "checksum")}) {
    std::string damaged = bytes;
    damaged[place] ^= 1;
    EXPECT_THAT(errorOfBytes(damaged),
                AllOf(StartsWith(file_.string() + ": byte "), HasSubstr(expected)));
  }
}

// Without this check, a short file could contain the same chunk any number of times.
TEST_F(Mcap, ChunksThatOverlapAreRejected) {
  write(2'000);
  std::string bytes = readText(file_);
  std::uint64_t size = 0;
  std::size_t chunk = kMcapMagic.size();
  while (bytes[chunk] != static_cast<char>(McapOp::kChunk)) {
    std::memcpy(&size, &bytes[chunk + 1], sizeof size);
    chunk += kMcapRecordHead + size;
  }
  // The chunk's index begins with the chunk's two times. Its offset and its size follow.
  const std::size_t index = bytes.rfind(bytes.substr(chunk + kMcapRecordHead, 16));
  std::memcpy(&size, &bytes[index + 24], sizeof size);
  size *= 2;  // doubled, because other records lie between chunks
  std::memcpy(&bytes[index + 24], &size, sizeof size);
  std::fill_n(bytes.end() - 12, 4, '\0');  // removes the checksum
  EXPECT_THAT(errorOfBytes(bytes),
              StartsWith(fmt::format("{}: byte {}: a chunk of {} bytes: expected its end before",
                                     file_.string(), chunk, size)));
}

// Checks all records: `McapBag` reads only some. (The schemas' texts are taken from the file.)
TEST_F(Mcap, EveryRecordIsAsOtherProgramsReadIt) {
  RigCamera unknown;
  unknown.model.width = unknown.model.height = 65'535;
  rig_.cameras.push_back(unknown);
  rig_.cameras[0].model.distortion = DistortionModel::kRadtan;
  std::vector<Event> packet;
  for (int i = 0; i < 40'000; ++i) {
    packet.push_back({kFirstNs + i, static_cast<std::uint16_t>(i % 640),
                      static_cast<std::uint16_t>(i % 480), i % 3 == 0});
  }
  const auto u16 = [](std::size_t value) { return wordBytes(static_cast<std::uint16_t>(value)); };
  const auto u32 = [](std::size_t value) { return wordBytes(static_cast<std::uint32_t>(value)); };
  const auto u64 = [](std::uint64_t value) { return wordBytes(value); };
  const auto crc = [&](const std::string& data) {
    return u32(crc32_z(0, reinterpret_cast<const Bytef*>(data.data()), data.size()));
  };
  const std::string names[] = {"/pose", "/cam0/events", "/cam0/camera_info", "/cam1/events",
                               "/cam1/camera_info"};
  struct Message {
    std::size_t channel;  // 1 is the first channel
    std::uint64_t t_ns;
    std::string data;
  };
  constexpr std::uint64_t kT = kFirstNs;
  std::vector<Message> messages = {
      {1, kT + 50'000, poseStamped(RosBytes::kCdr, kFirstNs + 50'000, T_world_rig_)}};
  const auto writer = openMcapWriter(file_, rig_);
  writer->addPose({kFirstNs + 50'000, T_world_rig_});
  RosMessage info(RosBytes::kCdr);
  info.header(kFirstNs, "cam0").u32(480).u32(640).text("plumb_bob").u32(4);
  info.numbers({0.1, -0.2, 0.3, -0.4, 500, 0, 320.5, 0, 501, 240.5, 0, 0, 1});
  info.numbers({1, 0, 0, 0, 1, 0, 0, 0, 1, 500, 0, 320.5, 0, 0, 501, 240.5, 0, 0, 0, 1, 0});
  for (int i = 0; i < 6; ++i) info.u32(0);
  messages.push_back({3, kT, info.u8(0).bytes()});
  for (std::uint64_t i = 0; i < 6; ++i) {  // 320 kB per packet
    const bool second = i == 3;
    writer->addEvents(second ? 1 : 0, packet);
    RosMessage message(RosBytes::kCdr);
    message.header(kFirstNs, second ? "cam1" : "cam0");
    message.u32(second ? 65'535 : 480).u32(second ? 65'535 : 640);
    message.add(second ? 0 : i > 3 ? i - 1 : i).add(kT).text("mono").u8(0);
    message.data(monoWords(packet, kFirstNs));
    messages.push_back({second ? 4U : 2U, kT, message.bytes()});
  }
  writer->close();
  const std::string bytes = readText(file_);

  std::string channels;
  for (std::size_t id = 1; id <= std::size(names); ++id) {
    channels += mcapRecordOf(
        4, u16(id) + u16(id) + sizedText(names[id - 1]) + sizedText("cdr") + sizedText(""));
  }
  const std::string magic("\x89MCAP0\r\n", 8);
  std::string file = magic + mcapRecordOf(1, sizedText("ros2") + sizedText("event-fusion-mapper"));
  const std::string schemas = bytes.substr(file.size(), bytes.find(channels) - file.size());
  file += schemas + channels;
  std::string indexes;
  std::size_t chunks = 0;
  std::map<std::size_t, std::size_t> counts;
  for (std::size_t next = 0; next < messages.size(); ++chunks) {
    std::string chunk;
    std::map<std::size_t, std::string> positions;  // per channel
    std::uint64_t first_ns = kEndOfTimeNs;
    std::uint64_t last_ns = 0;
    for (; next < messages.size() && chunk.size() < 1 << 20; ++next) {
      const auto& [channel, t_ns, data] = messages[next];
      positions[channel] += u64(t_ns) + u64(chunk.size());
      chunk +=
          mcapRecordOf(5, u16(channel) + u32(counts[channel]++) + u64(t_ns) + u64(t_ns) + data);
      first_ns = std::min(first_ns, t_ns);
      last_ns = std::max(last_ns, t_ns);
    }
    std::string packed(ZSTD_compressBound(chunk.size()), '\0');
    packed.resize(ZSTD_compress(packed.data(), packed.size(), chunk.data(), chunk.size(), 1));
    const std::string times = u64(first_ns) + u64(last_ns);
    const std::string zstd = sizedText("zstd") + u64(packed.size());
    const std::size_t begin = file.size();
    file += mcapRecordOf(6, times + u64(chunk.size()) + crc(chunk) + zstd + packed);
    const std::size_t end = file.size();
    std::string list;
    for (const auto& [channel, index] : positions) {
      list += u16(channel) + u64(file.size());
      file += mcapRecordOf(7, u16(channel) + sizedText(index));
    }
    indexes += mcapRecordOf(8, times + u64(begin) + u64(end - begin) + sizedText(list) +
                                   u64(file.size() - end) + zstd + u64(chunk.size()));
  }
  EXPECT_GT(chunks, 1U);
  file += mcapRecordOf(15, u32(0));
  const std::size_t summary = file.size();
  std::string list;
  for (std::size_t id = 1; id <= std::size(names); ++id) list += u16(id) + u64(counts[id]);
  file += schemas + channels + indexes +
          mcapRecordOf(11, u64(messages.size()) + u16(5) + u32(5) + u32(0) + u32(0) + u32(chunks) +
                               u64(kT) + u64(kT + 50'000) + sizedText(list));
  file += "\x02" + u64(20) + u64(summary) + u64(0);
  file += crc(file.substr(summary)) + magic;
  const auto differ = std::mismatch(bytes.begin(), bytes.end(), file.begin(), file.end());
  EXPECT_TRUE(bytes == file) << "from byte " << differ.first - bytes.begin();
}

}  // namespace
}  // namespace efm
