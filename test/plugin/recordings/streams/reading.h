// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "plugin/recordings/open/recording_formats.h"
#include "plugin/recordings/streams/event_packets.h"
#include "test/plugin/temporary_folder.h"

namespace efm {

/// Reads the next block of a stream. @throws std::runtime_error at damage; `events` are before it.
inline bool readBlock(EventStream& stream, std::vector<Event>& events) {
  const bool more = stream.read(events);
  if (!stream.damage().empty()) throw std::runtime_error(stream.damage());
  return more;
}

/// Returns all events of a stream. @throws std::runtime_error at damage.
inline std::vector<Event> readStream(EventStream& stream) {
  std::vector<Event> events;
  std::vector<Event> block;
  while (readBlock(stream, block)) events.insert(events.end(), block.begin(), block.end());
  return events;
}

/// Returns the events of all packets. @throws std::runtime_error at damage.
inline std::vector<Event> readPackets(EventPackets& packets) {
  std::vector<Event> events;
  for (auto packet = packets.nextPacket(); !packet.empty(); packet = packets.nextPacket()) {
    events.insert(events.end(), packet.begin(), packet.end());
  }
  if (!packets.damage().empty()) throw std::runtime_error(packets.damage());
  return events;
}

/// Reads damaged copies of a file: cut at many positions, and with flipped bits. Each copy is read
/// to its end, or rejected with an error that begins with the name of the file.
inline void readDamaged(const std::string& bytes, const std::filesystem::path& file,
                        const std::string& format_name) {
  const RecordingFormat* format = nullptr;
  for (const RecordingFormat& one : readerFormats()) {
    if (one.name == format_name) format = &one;
  }
  ASSERT_NE(format, nullptr);
  const auto read = [&](const std::string& damaged) {
    writeFile(file, damaged);
    try {
      RecordingParts parts = format->open({file}, {});
      for (const auto& camera : parts.cameras) readStream(*camera);
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(std::string(error.what()).rfind(file.string(), 0), 0U) << error.what();
    }
  };
  std::mt19937 random(1);
  for (int i = 0; i < 60; ++i) {
    read(bytes.substr(0, i < 20 ? static_cast<std::size_t>(i) : random() % bytes.size()));
    std::string flipped = bytes;
    // The beginning of the file has the lengths and the types.
    const std::size_t range = i % 2 == 0 ? std::min<std::size_t>(bytes.size(), 600) : bytes.size();
    for (int flips = 1 + i % 4; flips > 0; --flips) {
      flipped[random() % range] ^= static_cast<char>(1U << random() % 8);
    }
    read(flipped);
  }
}

}  // namespace efm
