// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/writers/mcap_file.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace efm {

std::uint32_t mcapChecksum(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string McapFile::beginRecords() const {
  std::string begin(kMcapMagic);
  appendMcapRecord(begin, McapHeader{"ros2", "event-fusion-mapper"});
  return begin + channelRecords();
}

std::string McapFile::channelRecords() const {
  std::string schemas;
  std::string channels;
  std::uint16_t id = 0;
  for (const McapTopic& topic : topics_) {
    ++id;
    appendMcapRecord(schemas, McapSchema{id, topic.type, "ros2msg", topic.schema});
    appendMcapRecord(channels, McapChannel{id, id, topic.topic, "cdr", {}});
  }
  return schemas + channels;
}

void McapFile::begin() {
  const std::string bytes = beginRecords();
  write_(0, bytes);
  position_ = bytes.size();
}

void McapFile::note(std::uint16_t channel, std::uint64_t log_ns, std::uint64_t position) {
  Channel& entry = channels_.at(channel - std::size_t{1});
  appendMcapFields(entry.index, log_ns, position);
  ++entry.messages;
  for (Span* span : {&chunk_span_, &file_span_}) {
    span->first_ns = std::min(span->first_ns, log_ns);
    span->last_ns = std::max(span->last_ns, log_ns);
  }
}

void McapFile::add(int channel, std::uint64_t log_ns, std::string_view message) {
  const auto id = static_cast<std::uint16_t>(channel);
  const auto number = static_cast<std::uint32_t>(channels_.at(id - std::size_t{1}).messages);
  note(id, log_ns, chunk_.size());
  appendMcapRecord(chunk_, McapMessage{id, number, log_ns, log_ns}, message);
}

void McapFile::finishChunk() {
  constexpr int kZstdLevel = 1;
  if (chunk_.empty()) return;
  std::string packed(ZSTD_compressBound(chunk_.size()), '\0');
  const std::size_t size =
      ZSTD_compress(packed.data(), packed.size(), chunk_.data(), chunk_.size(), kZstdLevel);
  if (ZSTD_isError(size) != 0) throw std::runtime_error(ZSTD_getErrorName(size));
  packed.resize(size);
  const McapChunk chunk{
      chunk_span_.first_ns, chunk_span_.last_ns, chunk_.size(), mcapChecksum(chunk_), "zstd", size};
  std::string bytes;
  appendMcapRecord(bytes, chunk, packed);
  const std::uint64_t begin = position_;
  bytes += closeChunk(chunk, bytes.size());
  write_(begin, bytes);
  chunk_.clear();
}

/// Returns the records that follow the chunk at this position, and goes on behind them.
std::string McapFile::closeChunk(const McapChunk& chunk, std::uint64_t record_size) {
  const std::uint64_t begin = position_ + record_size;
  std::string indexes;
  std::string positions;
  std::uint16_t id = 0;
  for (Channel& channel : channels_) {
    ++id;
    if (channel.index.empty()) continue;
    appendMcapFields(positions, id, begin + indexes.size());
    appendMcapRecord(indexes, McapMessageIndex{id, channel.index});
    channel.index.clear();
  }
  appendMcapRecord(chunk_indexes_, McapChunkIndex{chunk.first_log_ns, chunk.last_log_ns, position_,
                                                  record_size, positions, indexes.size(), "zstd",
                                                  chunk.packed_size, chunk.size});
  ++chunks_;
  chunk_span_ = {};
  position_ = begin + indexes.size();
  return indexes;
}

std::string McapFile::takeChunk(const McapChunk& chunk, std::uint64_t record_size,
                                std::string_view records) {
  ByteReader reader = readerOf(records);
  while (reader.remaining() > 0) {
    const std::uint64_t position = reader.position();
    McapRecord record = takeMcapRecord(reader);
    if (record.op != McapOp::kMessage) continue;
    const auto message = takeMcapFields<McapMessage>(record.content);
    note(message.channel, message.log_ns, position);
  }
  return closeChunk(chunk, record_size);
}

std::string McapFile::statistics() const {
  std::uint64_t messages = 0;
  std::string counts;
  std::uint16_t id = 0;
  for (const Channel& channel : channels_) {
    messages += channel.messages;
    appendMcapFields(counts, ++id, channel.messages);
  }
  McapStatistics statistics = {messages, id, id};
  statistics.chunks = chunks_;
  statistics.first_log_ns = messages > 0 ? file_span_.first_ns : 0;
  statistics.last_log_ns = file_span_.last_ns;
  statistics.channel_messages = counts;
  std::string record;
  appendMcapRecord(record, statistics);
  return record;
}

void McapFile::end() {
  finishChunk();
  std::string bytes;
  appendMcapRecord(bytes, McapDataEnd{});  // the data have no checksum: each chunk has one
  std::string summary = channelRecords() + chunk_indexes_ + statistics();
  const McapFooter footer = {position_ + bytes.size()};
  appendMcapRecord(summary, footer);
  summary.resize(summary.size() - sizeof(footer.checksum));
  appendLittleEndian(summary, mcapChecksum(summary));
  bytes.append(summary).append(kMcapMagic);
  write_(position_, bytes);
  position_ += bytes.size();
}

}  // namespace efm
