// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/sensors/aedat4.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <utility>

#include "mapping/geometry/timestamp.h"

namespace efm {
namespace {

constexpr std::uint64_t kAedat4PacketHeaderBytes = 8;
constexpr std::int64_t kNsPerAedat4Tick = 1'000;

bool isAedat4Named(const Aedat4StreamInfo& stream, const std::string& name) {
  return name == stream.name || name == stream.source || name == std::to_string(stream.id);
}

/// The streams that `topics` names, in its order; all without topics.
std::vector<Aedat4StreamInfo> chosenAedat4Streams(const std::filesystem::path& file,
                                                  const std::vector<Aedat4StreamInfo>& all,
                                                  const std::vector<std::string>& topics) {
  if (topics.empty()) return all;
  std::vector<Aedat4StreamInfo> chosen;
  for (const std::string& topic : topics) {
    std::copy_if(all.begin(), all.end(), std::back_inserter(chosen),
                 [&](const Aedat4StreamInfo& stream) { return isAedat4Named(stream, topic); });
  }
  if (!chosen.empty()) return chosen;
  std::string known;
  for (const Aedat4StreamInfo& stream : all) {
    known += fmt::format("{}{} ('{}' of '{}')", known.empty() ? "" : ", ", stream.id, stream.name,
                         stream.source);
  }
  throw std::runtime_error(fmt::format("{}: no stream '{}': expected one of {}", file.string(),
                                       fmt::join(topics, "', '"), known));
}

/// A stream of events of an AEDAT4 file (iniVation). A block is a packet. Times are Unix time.
class Aedat4Stream : public EventStream {
 public:
  /// @param stream one of `header->streams`.
  Aedat4Stream(std::filesystem::path file, std::shared_ptr<const Aedat4Header> header,
               Aedat4StreamInfo stream)
      : file_(std::move(file)),
        header_(std::move(header)),
        info_(std::move(stream)),
        stream_(file_, std::ios::binary),
        next_byte_(header_->packets_begin) {}

  bool read(std::vector<Event>& events) override {
    events.clear();
    if (!readPacket()) return false;
    Aedat4Events packet;
    try {
      decompressAedat4(header_->compression, packed_, flatbuffer_);
      packet = eventsOfAedat4(flatbuffer_);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(
          fmt::format("{}: byte {}: {}", file_.string(), packet_byte_, error.what()));
    }
    events.resize(packet.count);
    for (std::size_t i = 0; i < packet.count; ++i) {
      Aedat4Event from;
      std::memcpy(&from, packet.begin + i * sizeof(from), sizeof(from));
      constexpr std::int64_t kEndUs = kEndOfTimeNs / kNsPerAedat4Tick;
      if (from.t_us >= kEndUs || from.t_us <= -kEndUs) {
        events.resize(i);
        throw std::runtime_error(fmt::format(
            "{}: t = '{}': expected a time in µs before the year 2116", positionOf(i), from.t_us));
      }
      events[i] = {from.t_us * kNsPerAedat4Tick, static_cast<std::uint16_t>(from.x),
                   static_cast<std::uint16_t>(from.y), from.on != 0};
    }
    return true;
  }
  /// By the index at the end of the file. An index that is absent (the recording was interrupted)
  /// or does not fit the packets is not used.
  void seek(std::int64_t t_ns) override {
    if (!header_->has_index) return;
    const std::uint64_t size = header_->file_size - header_->packets_end;
    packed_.resize(size);
    stream_.seekg(static_cast<std::streamoff>(header_->packets_end));
    if (!stream_.read(reinterpret_cast<char*>(packed_.data()),
                      static_cast<std::streamsize>(size))) {
      stream_.clear();
      return;
    }
    std::vector<Aedat4IndexEntry> index;
    try {
      decompressAedat4(header_->compression, packed_, flatbuffer_);
      index = indexOfAedat4(flatbuffer_);
    } catch (const std::runtime_error&) {
      return;
    }
    bool listed = false;
    for (const Aedat4IndexEntry& entry : index) {
      if (entry.stream != info_.id) continue;
      listed = true;
      if (entry.last_us < t_ns / kNsPerAedat4Tick) continue;
      const std::uint64_t packet = entry.byte - kAedat4PacketHeaderBytes;
      if (packet < header_->packets_begin || packet >= header_->packets_end) return;
      stream_.seekg(static_cast<std::streamoff>(packet));
      if (nextInt32() == info_.id) next_byte_ = packet;
      return;
    }
    if (listed) next_byte_ = header_->packets_end;
  }
  std::string positionOf(std::size_t index) const override {
    return fmt::format("{}: packet at byte {}: event {}", file_.string(), packet_byte_, index);
  }
  std::string name() const override { return file_.string(); }
  double progress() const override {
    const std::uint64_t total = header_->packets_end - header_->packets_begin;
    if (total == 0) return 1;
    return static_cast<double>(next_byte_ - header_->packets_begin) / static_cast<double>(total);
  }
  std::optional<CameraSize> size() const override { return info_.size; }

 private:
  /// Reads the next packet of the stream into `packed_`. @return false at the end.
  bool readPacket() {
    while (next_byte_ < header_->packets_end) {
      packet_byte_ = next_byte_;
      stream_.seekg(static_cast<std::streamoff>(packet_byte_));
      const std::int32_t id = nextInt32();
      const std::int32_t size = nextInt32();
      const std::uint64_t data = packet_byte_ + kAedat4PacketHeaderBytes;
      const std::uint64_t left = header_->packets_end - std::min(data, header_->packets_end);
      if (!stream_ || size < 0 || static_cast<std::uint64_t>(size) > left) {
        throw std::runtime_error(
            fmt::format("{}: byte {}: a packet of {} bytes: expected at most {}, "
                        "up to the end of the packets",
                        file_.string(), packet_byte_, size, left));
      }
      next_byte_ = data + static_cast<std::uint64_t>(size);
      if (id != info_.id) continue;
      packed_.resize(static_cast<std::size_t>(size));
      if (!stream_.read(reinterpret_cast<char*>(packed_.data()), size)) {
        throw std::runtime_error(
            fmt::format("{}: byte {}: {} bytes cannot be read", file_.string(), data, size));
      }
      return true;
    }
    return false;
  }
  std::int32_t nextInt32() {
    std::int32_t value = 0;  // the host is little-endian, like the file
    stream_.read(reinterpret_cast<char*>(&value), sizeof(value));
    return value;
  }

  std::filesystem::path file_;
  std::shared_ptr<const Aedat4Header> header_;
  Aedat4StreamInfo info_;
  std::ifstream stream_;
  std::uint64_t next_byte_ = 0;           // of the next packet
  std::uint64_t packet_byte_ = 0;         // of the current packet
  std::vector<std::uint8_t> packed_;      // of the current packet
  std::vector<std::uint8_t> flatbuffer_;  // of the current packet, decompressed
};

}  // namespace

RecordingParts openAedat4(const std::vector<std::filesystem::path>& files,
                          const ReaderOptions& options) {
  RecordingParts parts;
  for (const std::filesystem::path& file : files) {
    const auto header = std::make_shared<const Aedat4Header>(readAedat4Header(file));
    if (header->streams.empty()) {
      throw std::runtime_error(file.string() + ": no stream of events: expected one (EVTS)");
    }
    for (Aedat4StreamInfo& stream : chosenAedat4Streams(file, header->streams, options.topics)) {
      parts.cameras.push_back(std::make_unique<Aedat4Stream>(file, header, std::move(stream)));
    }
  }
  return parts;
}

}  // namespace efm
