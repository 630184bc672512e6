// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>

#include "mapping/base/number_bytes.h"

/// The structure of MCAP files (mcap.dev/spec), for reader and writer: a magic word, records and
/// the magic word again. A record has an op, a size of 64 bits and its content: the fields of its
/// type below, little-endian. A text has a size of 32 bits before it. Arrays and maps are stored
/// the same way; here they are texts.
namespace efm {

inline constexpr std::string_view kMcapMagic("\x89MCAP0\r\n", 8);

enum class McapOp : std::uint8_t {
  kHeader = 1,
  kFooter = 2,
  kSchema = 3,
  kChannel = 4,
  kMessage = 5,
  kChunk = 6,
  kMessageIndex = 7,
  kChunkIndex = 8,
  kStatistics = 11,
  kSummaryOffset = 14,
  kDataEnd = 15,
};

struct McapHeader {
  static constexpr McapOp kOp = McapOp::kHeader;
  std::string_view profile = {}, library = {};
  auto fields() { return std::tie(profile, library); }
};

struct McapFooter {
  static constexpr McapOp kOp = McapOp::kFooter;
  std::uint64_t summary = 0, summary_offsets = 0;  ///< Positions in the file, bytes; 0: none.
  std::uint32_t checksum = 0;  ///< Of the bytes from the summary to this field; 0: unknown.
  auto fields() { return std::tie(summary, summary_offsets, checksum); }
};

struct McapSchema {
  static constexpr McapOp kOp = McapOp::kSchema;
  std::uint16_t id = 0;
  std::string_view name = {}, encoding = {}, data = {};
  auto fields() { return std::tie(id, name, encoding, data); }
};

struct McapChannel {
  static constexpr McapOp kOp = McapOp::kChannel;
  std::uint16_t id = 0, schema = 0;
  std::string_view topic = {}, encoding = {}, metadata = {};
  auto fields() { return std::tie(id, schema, topic, encoding, metadata); }
};

/// The message's data follow until the end of the record.
struct McapMessage {
  static constexpr McapOp kOp = McapOp::kMessage;
  std::uint16_t channel = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_ns = 0, published_ns = 0;
  auto fields() { return std::tie(channel, sequence, log_ns, published_ns); }
};

/// The chunk's records follow, compressed to `packed_size` bytes.
struct McapChunk {
  static constexpr McapOp kOp = McapOp::kChunk;
  std::uint64_t first_log_ns = 0, last_log_ns = 0, size = 0;
  std::uint32_t checksum = 0;  ///< Of the uncompressed records; 0: unknown.
  std::string_view compression = {};
  std::uint64_t packed_size = 0;
  auto fields() {
    return std::tie(first_log_ns, last_log_ns, size, checksum, compression, packed_size);
  }
};

struct McapMessageIndex {
  static constexpr McapOp kOp = McapOp::kMessageIndex;
  std::uint16_t channel = 0;
  std::string_view messages = {};  ///< Log time and position in the chunk of each message.
  auto fields() { return std::tie(channel, messages); }
};

struct McapChunkIndex {
  static constexpr McapOp kOp = McapOp::kChunkIndex;
  std::uint64_t first_log_ns = 0, last_log_ns = 0;
  std::uint64_t chunk = 0, chunk_record_size = 0;  ///< The chunk's record in the file, in bytes.
  std::string_view message_indexes = {};           ///< Channel and byte of each McapMessageIndex.
  std::uint64_t message_indexes_size = 0;
  std::string_view compression = {};
  std::uint64_t packed_size = 0, size = 0;
  auto fields() {
    return std::tie(first_log_ns, last_log_ns, chunk, chunk_record_size, message_indexes,
                    message_indexes_size, compression, packed_size, size);
  }
};

struct McapStatistics {
  static constexpr McapOp kOp = McapOp::kStatistics;
  std::uint64_t messages = 0;
  std::uint16_t schemas = 0;
  std::uint32_t channels = 0, attachments = 0, metadata = 0, chunks = 0;
  std::uint64_t first_log_ns = 0, last_log_ns = 0;
  std::string_view channel_messages = {};  ///< Channel and number of its messages.
  auto fields() {
    return std::tie(messages, schemas, channels, attachments, metadata, chunks, first_log_ns,
                    last_log_ns, channel_messages);
  }
};

struct McapDataEnd {
  static constexpr McapOp kOp = McapOp::kDataEnd;
  std::uint32_t checksum = 0;  ///< Of all bytes before this record; 0: unknown.
  auto fields() { return std::tie(checksum); }
};

inline constexpr std::size_t kMcapRecordHead = 9;      // op and size
inline constexpr std::size_t kMcapFooterContent = 20;  // bytes of its fields

/// Takes the fields of a record from the begin of its content. Texts refer to these bytes. Later
/// versions of MCAP may add fields; they stay in `content`.
/// @throws std::runtime_error if the content ends before the last field.
template <typename Record>
Record takeMcapFields(ByteReader& content) {
  Record record;
  const auto take = [&content](auto& field) {
    using Field = std::decay_t<decltype(field)>;
    if constexpr (std::is_arithmetic_v<Field>) {
      field = content.number<Field>();
    } else {
      field = content.text(content.number<std::uint32_t>());
    }
  };
  std::apply([&take](auto&... field) { (take(field), ...); }, record.fields());
  return record;
}

inline ByteReader readerOf(std::string_view bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

struct McapRecord {
  McapOp op;
  ByteReader content;
};

/// Takes a record. @throws std::runtime_error if the bytes end before it.
inline McapRecord takeMcapRecord(ByteReader& bytes) {
  const auto op = static_cast<McapOp>(bytes.number<std::uint8_t>());
  const auto size = bytes.number<std::uint64_t>();
  return {op, ByteReader(bytes.take(size), size)};
}

/// Appends numbers, and texts after their size.
template <typename... Fields>
void appendMcapFields(std::string& bytes, const Fields&... fields) {
  const auto append = [&](const auto& field) {
    if constexpr (std::is_arithmetic_v<std::decay_t<decltype(field)>>) {
      appendLittleEndian(bytes, field);
    } else {
      appendLittleEndian(bytes, static_cast<std::uint32_t>(field.size()));
      bytes.append(field);
    }
  };
  (append(fields), ...);
}

/// Appends a record: its op, its size, its fields, and the data that follow its fields.
template <typename Record>
void appendMcapRecord(std::string& bytes, Record record, std::string_view data = {}) {
  std::string fields;
  std::apply([&fields](const auto&... field) { appendMcapFields(fields, field...); },
             record.fields());
  bytes.push_back(static_cast<char>(Record::kOp));
  appendMcapFields(bytes, std::uint64_t{fields.size() + data.size()});
  bytes.append(fields).append(data);
}

}  // namespace efm
