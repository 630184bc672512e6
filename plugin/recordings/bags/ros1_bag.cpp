// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/bags/bag_source.h"

#include <fmt/format.h>

#include <map>
#include <optional>
#include <stdexcept>

#include "mapping/base/number_bytes.h"
#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/bags/bag_chunks.h"

namespace efm {
namespace {

constexpr std::string_view kRos1Version2 = "#ROSBAG V2.0\n";

enum class Ros1Op : std::uint8_t {
  kMessage = 2,
  kBagHeader = 3,
  kIndex = 4,
  kChunk = 5,
  kChunkInfo = 6,
  kConnection = 7,
};

/// The fields "name=value" of a header.
class Ros1Fields {
 public:
  explicit Ros1Fields(ByteReader bytes) {
    while (bytes.remaining() > 0) {
      const std::string_view field = bytes.text(bytes.number<std::uint32_t>());
      const std::size_t equals = field.find('=');
      if (equals == std::string_view::npos) {
        throw std::runtime_error(
            fmt::format("header field {}: expected NAME=VALUE", inQuotes(field)));
      }
      values_[field.substr(0, equals)] = field.substr(equals + 1);
    }
  }

  std::string_view text(std::string_view name) const {
    const auto found = values_.find(name);
    return found == values_.end() ? std::string_view() : found->second;
  }
  template <typename T>
  T number(std::string_view name) const {
    const std::string_view value = text(name);
    if (value.size() != sizeof(T)) {
      throw std::runtime_error(
          fmt::format("header field {} of {} bytes: expected {}", name, value.size(), sizeof(T)));
    }
    return ByteReader(reinterpret_cast<const std::uint8_t*>(value.data()), value.size())
        .number<T>();
  }
  /// Reads a time of seconds and nanoseconds, each of 32 bits.
  std::int64_t time(std::string_view name) const {
    const std::uint64_t value = number<std::uint64_t>(name);
    return static_cast<std::int64_t>(value & 0xffff'ffffU) * kNanosecondsPerSecond +
           static_cast<std::int64_t>(value >> 32);
  }
  Ros1Op op() const { return static_cast<Ros1Op>(number<std::uint8_t>("op")); }

 private:
  std::map<std::string_view, std::string_view> values_;
};

struct Ros1Record {
  Ros1Fields fields;
  const std::uint8_t* data;
  std::size_t size;
};

/// Takes the next record.
Ros1Record takeRecord(ByteReader& bytes) {
  const std::uint32_t header_size = bytes.number<std::uint32_t>();
  const std::uint8_t* const header = bytes.take(header_size);
  Ros1Fields fields(ByteReader(header, header_size));
  const std::uint32_t size = bytes.number<std::uint32_t>();
  return {std::move(fields), bytes.take(size), size};
}

class Ros1Bag : public ChunkedBag {
 public:
  explicit Ros1Bag(const std::filesystem::path& file) : ChunkedBag(file) {
    const std::size_t magic = kRos1Version2.size();
    const auto start = readBytes(0, std::min<std::uint64_t>(fileSize(), magic));
    const std::string_view text(reinterpret_cast<const char*>(start.get()),
                                std::min<std::uint64_t>(fileSize(), magic));
    if (text != kRos1Version2) {
      throw errorAt(0,
                    fmt::format("{}: expected a bag of version 2.0; `rosbag migrate` and `rosbag "
                                "reindex` convert older ones",
                                inQuotes(text)));
    }
    readSummary(readBagHeader(magic));
  }

 protected:
  ChunkMessages readChunk(const BagChunk& chunk) override;

 private:
  std::uint64_t readBagHeader(std::uint64_t offset);
  void readSummary(std::uint64_t offset);
  void addConnection(const Ros1Record& record);
  void addChunk(const Ros1Record& record, std::vector<BagChunk>& chunks);
  std::optional<std::size_t> topicOf(std::uint32_t connection) const {
    const auto found = topic_of_.find(connection);
    if (found == topic_of_.end()) return std::nullopt;
    return found->second;
  }

  std::map<std::uint32_t, std::size_t> topic_of_;  // by connection
};

/// @return the position of the summary: connections and chunk infos.
std::uint64_t Ros1Bag::readBagHeader(std::uint64_t offset) {
  constexpr std::uint64_t kBagHeaderBytes = 4096;  // it is padded to this size
  const std::uint64_t size = std::min(fileSize() - offset, kBagHeaderBytes + 8);
  const auto bytes = readBytes(offset, size);
  const std::uint64_t index = located(offset, [&] {
    ByteReader reader(bytes.get(), size);
    const Ros1Record record = takeRecord(reader);
    if (record.fields.op() != Ros1Op::kBagHeader) {
      throw std::runtime_error("another record: expected the bag's header");
    }
    if (!record.fields.text("encryptor").empty()) {
      throw std::runtime_error(fmt::format("a bag encrypted with {}: expected one without",
                                           inQuotes(record.fields.text("encryptor"))));
    }
    return record.fields.number<std::uint64_t>("index_pos");
  });
  if (index == 0 || index >= fileSize()) {
    throw errorAt(offset, fmt::format("index_pos = {} in a file of {} bytes: expected the position "
                                      "of the index. The recording was cut off; `rosbag reindex` "
                                      "repairs it",
                                      index, fileSize()));
  }
  return index;
}

void Ros1Bag::readSummary(std::uint64_t offset) {
  const std::uint64_t size = fileSize() - offset;
  const auto bytes = readBytes(offset, size);
  std::vector<BagChunk> chunks;
  ByteReader reader(bytes.get(), size);
  while (reader.remaining() > 0) {
    located(offset + reader.position(), [&] {
      const Ros1Record record = takeRecord(reader);
      switch (record.fields.op()) {
        case Ros1Op::kConnection:
          return addConnection(record);
        case Ros1Op::kChunkInfo:
          return addChunk(record, chunks);
        default:
          throw std::runtime_error(fmt::format("record of op {}: expected connections and chunks",
                                               static_cast<int>(record.fields.op())));
      }
    });
  }
  std::sort(chunks.begin(), chunks.end(),
            [](const BagChunk& a, const BagChunk& b) { return a.offset < b.offset; });
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    const std::uint64_t end = i + 1 < chunks.size() ? chunks[i + 1].offset : offset;
    if (end <= chunks[i].offset) {
      throw errorAt(chunks[i].offset, "a chunk behind the index: expected it before");
    }
    chunks[i].size = end - chunks[i].offset;
  }
  setChunks(std::move(chunks));
}

void Ros1Bag::addConnection(const Ros1Record& record) {
  const Ros1Fields connection(ByteReader(record.data, record.size));
  const BagTopic topic = {std::string(record.fields.text("topic")),
                          std::string(connection.text("type"))};
  // Several publishers of a topic have a connection each.
  topic_of_[record.fields.number<std::uint32_t>("conn")] = addTopic(topic);
}

void Ros1Bag::addChunk(const Ros1Record& record, std::vector<BagChunk>& chunks) {
  BagChunk chunk;
  chunk.offset = record.fields.number<std::uint64_t>("chunk_pos");
  chunk.first_log_ns = record.fields.time("start_time");
  chunk.last_log_ns = record.fields.time("end_time");
  chunk.topics = 0;
  ByteReader counts(record.data, record.size);  // of messages, per connection
  while (counts.remaining() > 0) {
    const auto found = topicOf(counts.number<std::uint32_t>());
    const auto count = counts.number<std::uint32_t>();
    if (!found) continue;
    chunk.topics |= topicBit(*found);
    topic(*found).add(count, chunk.first_log_ns, chunk.last_log_ns);
  }
  chunks.push_back(chunk);
}

ChunkMessages Ros1Bag::readChunk(const BagChunk& chunk) {
  auto file = readBytes(chunk.offset, chunk.size);  // with the index after the chunk
  return located(chunk.offset, [&] {
    ByteReader reader(file.get(), chunk.size);
    const Ros1Record record = takeRecord(reader);
    if (record.fields.op() != Ros1Op::kChunk) {
      throw std::runtime_error(
          fmt::format("record of op {}: expected a chunk", static_cast<int>(record.fields.op())));
    }
    const ChunkCompression compression =
        chunkCompression(record.fields.text("compression"), {"none", "bz2", "lz4"});
    const std::uint32_t size = record.fields.number<std::uint32_t>("size");
    ChunkMessages chunk_messages;
    chunk_messages.bytes =
        unpackChunk(compression, {std::move(file), record.data, record.size}, size);
    ByteReader messages(chunk_messages.bytes.data, size);
    while (messages.remaining() > 0) {
      const Ros1Record message = takeRecord(messages);
      if (message.fields.op() != Ros1Op::kMessage) continue;
      if (const auto topic = topicOf(message.fields.number<std::uint32_t>("conn"))) {
        chunk_messages.messages.push_back(
            {{message.fields.time("time"), message.data, message.size, false}, *topic});
      }
    }
    return chunk_messages;
  });
}

}  // namespace

std::unique_ptr<BagSource> openRos1Bag(const std::filesystem::path& file) {
  return std::make_unique<Ros1Bag>(file);
}

}  // namespace efm
