// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <zlib.h>

#include <exception>
#include <map>
#include <stdexcept>

#include "mapping/base/number_bytes.h"
#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/bags/bag_chunks.h"
#include "plugin/recordings/bags/bag_source.h"
#include "plugin/recordings/bags/mcap_records.h"

namespace efm {
namespace {

std::int64_t logTime(std::uint64_t t_ns) {
  if (t_ns < static_cast<std::uint64_t>(kEndOfTimeNs)) return static_cast<std::int64_t>(t_ns);
  throw std::runtime_error(
      fmt::format("log time {}: expected a time in ns before the year 2116", t_ns));
}

void requireChecksum(std::uint32_t claimed, const std::uint8_t* data, std::size_t size) {
  if (claimed == 0) return;
  const auto found = static_cast<std::uint32_t>(crc32_z(0, data, size));
  if (found == claimed) return;
  throw std::runtime_error(
      fmt::format("damaged data of checksum {:08x}: expected {:08x}", found, claimed));
}

class McapBag : public ChunkedBag {
 public:
  explicit McapBag(const std::filesystem::path& file)
      : ChunkedBag(file, " (`mcap recover` writes a file of what is intact)") {
    if (!readSummary()) scanFile();
  }

 protected:
  ChunkMessages readChunk(const BagChunk& chunk) override;

 private:
  bool readSummary();
  void scanFile();
  ChunkMessages messagesIn(ChunkBytes bytes);
  void takeSchemaOrChannel(McapRecord& record);
  BagChunk chunkOfIndex(ByteReader content);

  struct Channel {
    std::size_t topic;
    bool cdr;
  };
  std::map<std::uint16_t, std::string> types_;  // by the schema's id
  std::map<std::uint16_t, Channel> channels_;
};

/// Reads the summary. @return whether it has an index of the chunks and their channels.
bool McapBag::readSummary() {
  const std::uint64_t magic = kMcapMagic.size();
  const std::uint64_t tail_size = kMcapRecordHead + kMcapFooterContent + magic;
  if (fileSize() < magic + tail_size) return false;
  const std::uint64_t footer = fileSize() - tail_size;
  const auto tail = readBytes(footer, tail_size);
  ByteReader bytes(tail.get(), tail_size);
  const auto op = static_cast<McapOp>(bytes.number<std::uint8_t>());
  const std::uint64_t size = bytes.number<std::uint64_t>();
  const auto fields = takeMcapFields<McapFooter>(bytes);
  const std::uint64_t summary = fields.summary;
  if (op != McapOp::kFooter || size != kMcapFooterContent || bytes.text(magic) != kMcapMagic) {
    return false;  // the recording was cut off
  }
  if (summary == 0) return false;
  if (summary < magic || summary > footer) {
    throw errorAt(footer, fmt::format("summary at byte {}: expected it between {} and {}", summary,
                                      magic, footer));
  }

  const auto section = readBytes(summary, fileSize() - summary);
  located(summary, [&] {
    requireChecksum(
        fields.checksum, section.get(),
        footer - summary + kMcapRecordHead + kMcapFooterContent - sizeof(fields.checksum));
  });
  // Chunks refer to channels, which may come after them.
  std::vector<std::pair<std::uint64_t, ByteReader>> indexes;
  ByteReader counts = readerOf({});  // of each channel's messages
  bool has_channels = false;
  ByteReader records(section.get(), footer - summary);
  while (records.remaining() > 0) {
    const std::uint64_t at = summary + records.position();
    located(at, [&] {
      McapRecord record = takeMcapRecord(records);
      if (record.op == McapOp::kChunkIndex) indexes.emplace_back(at, record.content);
      if (record.op == McapOp::kStatistics) {
        counts = readerOf(takeMcapFields<McapStatistics>(record.content).channel_messages);
      }
      has_channels = has_channels || record.op == McapOp::kChannel;
      takeSchemaOrChannel(record);
    });
  }
  if (indexes.empty() || !has_channels) return false;
  std::vector<BagChunk> chunks;
  for (const auto& [at, content] : indexes) {
    located(at, [&, index = content] { chunks.push_back(chunkOfIndex(index)); });
  }
  std::sort(chunks.begin(), chunks.end(),
            [](const BagChunk& a, const BagChunk& b) { return a.offset < b.offset; });
  for (std::size_t i = 1; i < chunks.size(); ++i) {
    const BagChunk& before = chunks[i - 1];
    if (before.size <= chunks[i].offset - before.offset) continue;
    throw errorAt(before.offset, fmt::format("a chunk of {} bytes: expected its end before the "
                                             "next one, which begins at byte {}",
                                             before.size, chunks[i].offset));
  }
  setChunks(std::move(chunks));
  while (counts.remaining() >= sizeof(std::uint16_t) + sizeof(std::uint64_t)) {
    const auto channel = channels_.find(counts.number<std::uint16_t>());
    const auto count = counts.number<std::uint64_t>();
    if (channel != channels_.end()) topic(channel->second.topic).messages += count;
  }
  return true;
}

BagChunk McapBag::chunkOfIndex(ByteReader content) {
  const auto index = takeMcapFields<McapChunkIndex>(content);
  BagChunk chunk;
  chunk.first_log_ns = logTime(index.first_log_ns);
  chunk.last_log_ns = logTime(index.last_log_ns);
  chunk.offset = index.chunk;
  chunk.size = index.chunk_record_size;
  ByteReader indexes = readerOf(index.message_indexes);
  if (indexes.remaining() > 0) chunk.topics = 0;  // else the topics are unknown
  while (indexes.remaining() > 0) {
    const auto channel = channels_.find(indexes.number<std::uint16_t>());
    indexes.number<std::uint64_t>();
    if (channel == channels_.end()) continue;
    chunk.topics |= topicBit(channel->second.topic);
    topic(channel->second.topic).add(0, chunk.first_log_ns, chunk.last_log_ns);
  }
  return chunk;
}

void McapBag::takeSchemaOrChannel(McapRecord& record) {
  if (record.op == McapOp::kSchema) {
    const auto schema = takeMcapFields<McapSchema>(record.content);
    types_[schema.id] = typeWithoutMsg(std::string(schema.name));
  } else if (record.op == McapOp::kChannel) {
    const auto channel = takeMcapFields<McapChannel>(record.content);
    const auto type = types_.find(channel.schema);
    const bool cdr = channel.encoding == "cdr";
    if (type == types_.end() || (!cdr && channel.encoding != "ros1")) return;
    channels_[channel.id] = {addTopic({std::string(channel.topic), type->second}), cdr};
  }
}

/// Finds channels, chunks and messages outside chunks. Many of the latter form one chunk. If the
/// data are damaged or cut off, reading the last chunk throws the error, after the chunks before it
/// are read.
void McapBag::scanFile() {
  constexpr std::uint64_t kLooseBytes = 1 << 20;
  std::vector<BagChunk> chunks;
  BagChunk loose;  // messages outside chunks
  std::exception_ptr damage;
  const auto add = [&](BagChunk& chunk) {
    if (chunk.size == 0) return;
    if (!chunks.empty()) chunk.first_log_ns = chunk.last_log_ns = chunks.back().last_log_ns;
    try {
      const ChunkMessages found = readChunk(chunk);
      chunk.topics = 0;
      for (const ChunkMessages::Message& message : found.messages) {
        const bool first = chunk.topics == 0;
        chunk.first_log_ns = first ? message.log_ns : std::min(chunk.first_log_ns, message.log_ns);
        chunk.last_log_ns = first ? message.log_ns : std::max(chunk.last_log_ns, message.log_ns);
        chunk.topics |= topicBit(message.topic);
        topic(message.topic).add(1, message.log_ns, message.log_ns);
      }
    } catch (const std::runtime_error&) {
      damage = std::current_exception();
      chunk.topics = ~std::uint64_t{0};
    }
    chunks.push_back(chunk);
    chunk.size = 0;
  };
  for (std::uint64_t offset = kMcapMagic.size(); offset < fileSize();) {
    BagChunk record;
    record.offset = offset;
    record.size = fileSize() - offset + 1;  // more than the file has
    McapOp op = McapOp::kChunk;
    if (fileSize() - offset >= kMcapRecordHead) {
      const auto head = readBytes(offset, kMcapRecordHead);
      ByteReader bytes(head.get(), kMcapRecordHead);
      op = static_cast<McapOp>(bytes.number<std::uint8_t>());
      if (op == McapOp::kDataEnd || op == McapOp::kFooter) break;
      const std::uint64_t size = bytes.number<std::uint64_t>();
      // A file that was not written to its end may end in zeros, which are no records.
      if (op != McapOp() && size < record.size - kMcapRecordHead) {
        record.size = kMcapRecordHead + size;
      }
    }
    const std::uint64_t next = offset + record.size;
    if (next > fileSize()) op = McapOp::kChunk;
    if (op == McapOp::kMessage) {
      if (loose.size == 0) loose.offset = offset;
      loose.size = next - loose.offset;
    }
    if (op != McapOp::kMessage || loose.size >= kLooseBytes) add(loose);
    if (op == McapOp::kChunk) add(record);
    if (op == McapOp::kSchema || op == McapOp::kChannel) {
      const auto content = readBytes(offset, record.size);
      located(offset, [&] {
        ByteReader bytes(content.get(), record.size);
        McapRecord taken = takeMcapRecord(bytes);
        takeSchemaOrChannel(taken);
      });
    }
    offset = next;
  }
  add(loose);
  if (damage && topics().empty()) std::rethrow_exception(damage);  // else nobody would report it
  setChunks(std::move(chunks));
}

ChunkMessages McapBag::readChunk(const BagChunk& chunk) {
  ChunkBytes file = {readBytes(chunk.offset, chunk.size), nullptr, chunk.size};
  file.data = file.memory.get();
  return located(chunk.offset, [&] {
    if (chunk.size > 0 && static_cast<McapOp>(*file.data) == McapOp::kMessage) {
      return messagesIn(std::move(file));
    }
    ByteReader bytes(file.data, file.size);
    auto [op, content] = takeMcapRecord(bytes);
    if (op != McapOp::kChunk) {
      throw std::runtime_error(
          fmt::format("record of op {}: expected a chunk", static_cast<int>(op)));
    }
    const auto head = takeMcapFields<McapChunk>(content);
    const ChunkCompression compression = chunkCompression(head.compression, {"", "lz4", "zstd"});
    file.size = head.packed_size;
    file.data = content.take(file.size);
    ChunkBytes records = unpackChunk(compression, std::move(file), head.size);
    requireChecksum(head.checksum, records.data, records.size);
    return messagesIn(std::move(records));
  });
}

/// Decodes the messages in records.
ChunkMessages McapBag::messagesIn(ChunkBytes bytes) {
  ChunkMessages chunk;
  ByteReader records(bytes.data, bytes.size);
  chunk.bytes = std::move(bytes);
  while (records.remaining() > 0) {
    McapRecord record = takeMcapRecord(records);
    takeSchemaOrChannel(record);
    if (record.op != McapOp::kMessage) continue;
    ByteReader& content = record.content;
    const auto message = takeMcapFields<McapMessage>(content);
    const auto channel = channels_.find(message.channel);
    const std::int64_t log_ns = logTime(message.log_ns);
    if (channel == channels_.end()) continue;
    const std::size_t size = content.remaining();
    chunk.messages.push_back(
        {{log_ns, content.take(size), size, channel->second.cdr}, channel->second.topic});
  }
  return chunk;
}

}  // namespace

std::unique_ptr<BagSource> openMcap(const std::filesystem::path& file) {
  return std::make_unique<McapBag>(file);
}

}  // namespace efm
