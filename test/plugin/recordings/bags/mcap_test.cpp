// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "mapping/base/number_bytes.h"
#include "plugin/recordings/bags/bag_recording.h"
#include "plugin/recordings/bags/bag_source.h"
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

/// A recording of 2 s of one camera, in chunks of 1 MiB.
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
  writer->addEvents(0, events);  // 12 s
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
  // The rest is missing, or was not written any more.
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
        recording.cameras.at(0)->read(block);
        read.insert(read.end(), block.begin(), block.end());
      }
    });
    EXPECT_THAT(damage, AllOf(StartsWith(file_.string() + ": byte "), HasSubstr(expected),
                              HasSubstr("`mcap recover`")));
    EXPECT_EQ(recording.poses_damage, damage);
    // The messages of a chunk come in the order of their times.
    EXPECT_NEAR(static_cast<double>(read.size()), 2e3 * static_cast<double>(recording.poses.size()),
                2e3);
    EXPECT_TRUE(std::equal(read.begin(), read.end(), events_.begin()));
    EXPECT_EQ(errorOf([&] { readPoses(file_, {}); }), damage) << "by --poses";
  }
  // Within the first chunk, nothing is known of any topic.
  EXPECT_THAT(errorOfBytes(bytes.substr(0, 5'000)), HasSubstr("which may be cut off"));
}

TEST_F(Mcap, DamageAmongThePosesIsToldAfterAllEvents) {
  write(200);
  const auto writer = openMcapWriter(file_, rig_);
  writer->addEvents(0, events_);
  for (std::int64_t i = 0; i < 20'000; ++i) {
    writer->addPose({kFirstNs + i * 100'000, T_world_rig_});  // chunks of their own
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

// Else a short file could claim the same chunk any number of times.
TEST_F(Mcap, ChunksThatOverlapAreRefused) {
  write(2'000);
  std::string bytes = readText(file_);
  std::uint64_t size = 0;
  std::size_t chunk = kMcapMagic.size();
  while (bytes[chunk] != static_cast<char>(McapOp::kChunk)) {
    std::memcpy(&size, &bytes[chunk + 1], sizeof size);
    chunk += kMcapRecordHead + size;
  }
  // The chunk's index begins with the same two times; then come its offset and its size.
  const std::size_t index = bytes.rfind(bytes.substr(chunk + kMcapRecordHead, 16));
  std::memcpy(&size, &bytes[index + 24], sizeof size);
  size *= 2;  // records of another kind lie between chunks
  std::memcpy(&bytes[index + 24], &size, sizeof size);
  std::fill_n(bytes.end() - 12, 4, '\0');  // no checksum
  EXPECT_THAT(errorOfBytes(bytes),
              StartsWith(fmt::format("{}: byte {}: a chunk of {} bytes: expected its end before",
                                     file_.string(), chunk, size)));
}

/// What a message has, and a chunk: for its indexes.
struct Written {
  std::vector<std::string> messages;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> in_chunk;  // time, position
};

// `McapBag` reads only some of it.
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
  const auto writer = openMcapWriter(file_, rig_);
  writer->addPose({kFirstNs + 50'000, T_world_rig_});
  std::map<std::string, std::vector<std::string>> expected;
  expected["/pose"] = {poseStamped(RosBytes::kCdr, kFirstNs + 50'000, T_world_rig_)};
  for (std::uint64_t i = 0; i < 6; ++i) {  // 320 kB each
    const std::string name = i == 3 ? "cam1" : "cam0";
    const std::uint64_t sequence = i == 3 ? 0 : i > 3 ? i - 1 : i;
    writer->addEvents(i == 3 ? 1 : 0, packet);
    expected["/" + name + "/events"].push_back(RosMessage(RosBytes::kCdr)
                                                   .header(kFirstNs, name)
                                                   .u32(i == 3 ? 65'535 : 480)
                                                   .u32(i == 3 ? 65'535 : 640)
                                                   .add(sequence)
                                                   .add(static_cast<std::uint64_t>(kFirstNs))
                                                   .text("mono")
                                                   .u8(0)
                                                   .data(monoWords(packet, kFirstNs))
                                                   .bytes());
  }
  RosMessage info(RosBytes::kCdr);
  info.header(kFirstNs, "cam0").u32(480).u32(640).text("plumb_bob").u32(4);
  info.numbers({0.1, -0.2, 0.3, -0.4, 500, 0, 320.5, 0, 501, 240.5, 0, 0, 1});
  info.numbers({1, 0, 0, 0, 1, 0, 0, 0, 1, 500, 0, 320.5, 0, 0, 501, 240.5, 0, 0, 0, 1, 0});
  for (int i = 0; i < 6; ++i) info.u32(0);
  expected["/cam0/camera_info"] = {info.u8(0).bytes()};
  writer->close();

  const std::string bytes = readText(file_);
  const auto at = [](const std::string& text, std::size_t position = 0) {
    return ByteReader(reinterpret_cast<const std::uint8_t*>(text.data()) + position,
                      text.size() - position);
  };
  const auto text_in = [](ByteReader& reader) {
    return std::string(reader.text(reader.number<std::uint32_t>()));
  };
  std::map<std::uint16_t, std::string> topics;
  std::map<std::uint16_t, Written> written;
  std::string index;                 // of the last chunk, as the summary should have it
  std::vector<std::string> indexes;  // of all
  std::map<std::uint16_t, std::uint64_t> positions;
  std::size_t index_begin = 0;
  const auto finish = [&](std::size_t end) {
    if (index.empty()) return;
    std::string list;
    for (const auto& [id, position] : positions) list += wordBytes(id) + wordBytes(position);
    indexes.push_back(replaced(index, "INDEXES", sizedText(list) + wordBytes(end - index_begin)));
    index.clear();
    positions.clear();
  };
  ASSERT_EQ(bytes.substr(0, 8), kMcapMagic);
  ASSERT_EQ(bytes.substr(bytes.size() - 8), kMcapMagic);
  std::size_t summary = 0;
  std::size_t seen_indexes = 0;
  for (std::size_t begin = 8; begin + 8 < bytes.size();) {
    ByteReader head = at(bytes, begin);
    const auto op = static_cast<McapOp>(head.number<std::uint8_t>());
    const auto size = head.number<std::uint64_t>();
    const std::string content = bytes.substr(begin + 9, size);
    ByteReader record = at(content);
    if (op != McapOp::kMessageIndex) finish(begin);
    if (op == McapOp::kHeader) {
      EXPECT_EQ(content, sizedText("ros2") + sizedText("event-fusion-mapper"));
    }
    if (op == McapOp::kChannel) {
      const auto id = record.number<std::uint16_t>();
      EXPECT_EQ(record.number<std::uint16_t>(), id) << "its schema";
      topics[id] = text_in(record);
      EXPECT_EQ(text_in(record), "cdr");
      EXPECT_EQ(text_in(record), "") << "metadata";
    }
    if (op == McapOp::kChunk) {
      index =
          content.substr(0, 16) + wordBytes(std::uint64_t{begin}) + wordBytes(size + 9) + "INDEXES";
      record.take(16);
      const auto count = record.number<std::uint64_t>();
      const auto checksum = record.number<std::uint32_t>();
      EXPECT_EQ(text_in(record), "zstd");
      const auto packed = record.number<std::uint64_t>();
      EXPECT_EQ(packed, record.remaining());
      index += sizedText("zstd") + wordBytes(packed) + wordBytes(count);
      std::string chunk(count, '\0');
      ASSERT_EQ(ZSTD_decompress(chunk.data(), count, record.take(packed), packed), count);
      EXPECT_EQ(crc32_z(0, reinterpret_cast<const Bytef*>(chunk.data()), count), checksum);
      std::vector<std::uint64_t> times;
      for (auto& [id, channel] : written) channel.in_chunk.clear();
      for (ByteReader messages = at(chunk); messages.remaining() > 0;) {
        const std::uint64_t position = messages.position();
        ASSERT_EQ(static_cast<McapOp>(messages.number<std::uint8_t>()), McapOp::kMessage);
        const auto length = messages.number<std::uint64_t>();
        Written& channel = written[messages.number<std::uint16_t>()];
        EXPECT_EQ(messages.number<std::uint32_t>(), channel.messages.size());
        times.push_back(messages.number<std::uint64_t>());
        EXPECT_EQ(messages.number<std::uint64_t>(), times.back()) << "published";
        channel.in_chunk.emplace_back(times.back(), position);
        channel.messages.emplace_back(messages.text(length - 22));
      }
      const auto [first, last] = std::minmax_element(times.begin(), times.end());
      EXPECT_EQ(content.substr(0, 16), wordBytes(*first) + wordBytes(*last));
      index_begin = begin + 9 + size;
    }
    if (op == McapOp::kMessageIndex) {
      const auto id = record.number<std::uint16_t>();
      positions[id] = begin;
      std::string list;
      for (const auto& [t_ns, position] : written[id].in_chunk) {
        list += wordBytes(t_ns) + wordBytes(position);
      }
      EXPECT_EQ(text_in(record), list);
    }
    if (op == McapOp::kDataEnd) summary = begin + 9 + size;
    if (op == McapOp::kChunkIndex) {
      EXPECT_EQ(content, indexes.at(seen_indexes++));
    }
    if (op == McapOp::kStatistics) {
      std::string counts;
      for (const auto& [id, topic] : topics) {
        counts += wordBytes(id) + wordBytes(std::uint64_t{expected[topic].size()});
      }
      EXPECT_EQ(content,
                wordBytes(std::uint64_t{8}) + wordBytes(std::uint16_t{5}) + wordBytes(5U) +
                    std::string(8, '\0') + wordBytes(static_cast<unsigned>(indexes.size())) +
                    wordBytes(static_cast<std::uint64_t>(kFirstNs)) +
                    wordBytes(static_cast<std::uint64_t>(kFirstNs) + 50'000) + sizedText(counts));
    }
    if (op == McapOp::kFooter) {
      EXPECT_EQ(record.number<std::uint64_t>(), summary);
      EXPECT_EQ(record.number<std::uint64_t>(), 0U) << "no summary offsets";
      EXPECT_EQ(record.number<std::uint32_t>(),
                crc32_z(0, reinterpret_cast<const Bytef*>(&bytes[summary]), begin + 25 - summary));
    }
    begin += 9 + size;
  }
  EXPECT_GT(indexes.size(), 1U);
  EXPECT_EQ(seen_indexes, indexes.size());
  for (const auto& [id, topic] : topics) {
    EXPECT_TRUE(written[id].messages == expected[topic]) << topic;
  }
  EXPECT_EQ(topics.size(), 5U);
}

TEST_F(Mcap, DamagedFilesAreReadOrRefused) {
  write(20);
  readDamaged(readText(file_), file_, "rosbag2");
}

}  // namespace
}  // namespace efm
