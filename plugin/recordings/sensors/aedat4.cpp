// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/sensors/aedat4.h"

#include <fmt/format.h>
#include <lz4frame.h>
#include <tinyxml2.h>
#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "mapping/base/number_bytes.h"
#include "mapping/base/text.h"
#include "mapping/geometry/timestamp.h"
#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/recordings/streams/time_unit.h"

namespace efm {
namespace {

/// A stream of events that the header of an AEDAT4 file lists.
struct Aedat4StreamInfo {
  std::int32_t id = 0;
  std::string name;    ///< The module's output: "events".
  std::string source;  ///< The camera: "DVXplorer_DXA00093".
  std::optional<CameraSize> size;
};

struct Aedat4Header {
  Aedat4Compression compression = Aedat4Compression::kNone;
  std::uint64_t packets_begin = 0;  ///< The byte of the first packet.
  std::uint64_t packets_end = 0;    ///< The byte after the last packet.
  bool has_index = false;           ///< True if an index follows the packets.
  std::uint64_t file_size = 0;
  std::vector<Aedat4StreamInfo> streams;  ///< Streams of events (EVTS), by their numbers.
};

/// The position of a packet, from the index at the end of the file.
struct Aedat4IndexEntry {
  std::uint64_t byte = 0;  ///< Byte of the packet's data, after 8 bytes of stream and size.
  std::int32_t stream = 0;
  std::int64_t last_us = 0;  ///< The time of the last event.
};

constexpr std::size_t kMaxAedat4Bytes = std::size_t{1} << 28U;

/// A table of a FlatBuffer. Its values may be at any byte, because writers in other languages than
/// C++ align them differently. So each value is copied from a checked position.
class FlatTable {
 public:
  /// Opens the root table of a FlatBuffer that follows its size (4 bytes). `bytes` must outlive it.
  FlatTable(const std::vector<std::uint8_t>& bytes, std::string_view identifier)
      : bytes_(bytes.data()), size_(bytes.size()) {
    constexpr std::uint64_t kSizeBytes = 4;
    if (size_ < kSizeBytes + 8 || valueAt<std::uint32_t>(0) != size_ - kSizeBytes ||
        textAt(kSizeBytes + 4, 4) != identifier) {
      throw std::runtime_error(
          fmt::format("{} bytes: expected a FlatBuffer '{}' of this size", size_, identifier));
    }
    table_ = targetOf(kSizeBytes);
  }

  bool has(std::uint64_t field) const { return positionOf(field).has_value(); }
  template <typename Number>
  Number number(std::uint64_t field, Number absent) const {
    const std::optional<std::uint64_t> position = positionOf(field);
    return position ? valueAt<Number>(*position) : absent;
  }
  std::string_view text(std::uint64_t field) const {
    const Elements characters = elements(field, 1);
    return textAt(characters.position, characters.count);
  }
  /// The position and number of a vector's elements; none if the table has no such field.
  struct Elements {
    std::uint64_t position = 0;
    std::uint64_t count = 0;
  };
  Elements elements(std::uint64_t field, std::uint64_t element_bytes) const {
    const std::optional<std::uint64_t> position = positionOf(field);
    if (!position) return {};
    const std::uint64_t vector = targetOf(*position);
    const std::uint64_t count = valueAt<std::uint32_t>(vector);
    require(vector + sizeof(std::uint32_t), count * element_bytes);
    return {vector + sizeof(std::uint32_t), count};
  }
  /// Returns a table from a vector of tables.
  FlatTable element(const Elements& tables, std::uint64_t index) const {
    FlatTable table = *this;
    table.table_ = targetOf(tables.position + index * sizeof(std::uint32_t));
    return table;
  }

 private:
  void require(std::uint64_t position, std::uint64_t count) const {
    if (position <= size_ && count <= size_ - position) return;
    throw std::runtime_error(
        fmt::format("a FlatBuffer of {} bytes with a value at byte {}: expected "
                    "all values within it",
                    size_, position));
  }
  template <typename Number>
  Number valueAt(std::uint64_t position) const {
    require(position, sizeof(Number));
    return numberFrom<Number>(bytes_ + position, false);
  }
  std::string_view textAt(std::uint64_t position, std::uint64_t count) const {
    require(position, count);
    return {reinterpret_cast<const char*>(bytes_ + position), static_cast<std::size_t>(count)};
  }
  std::uint64_t targetOf(std::uint64_t offset) const {
    return offset + valueAt<std::uint32_t>(offset);
  }
  /// Reads a field's position from a list near the table: absent fields have 0 or no entry.
  std::optional<std::uint64_t> positionOf(std::uint64_t field) const {
    const std::uint64_t list =
        table_ - static_cast<std::uint64_t>(std::int64_t{valueAt<std::int32_t>(table_)});
    const std::uint64_t entry = 4 + 2 * field;
    if (entry + 2 > valueAt<std::uint16_t>(list)) return std::nullopt;
    const std::uint16_t offset = valueAt<std::uint16_t>(list + entry);
    if (offset == 0) return std::nullopt;
    return table_ + offset;
  }

  const std::uint8_t* bytes_;
  std::uint64_t size_;
  std::uint64_t table_ = 0;
};

/// Returns a child <node name="…"> or <attr key="…"> of a node; null if there is none.
const tinyxml2::XMLElement* xmlChild(const tinyxml2::XMLElement* node, const char* kind,
                                     const char* key, const char* value) {
  if (node == nullptr) return nullptr;
  const tinyxml2::XMLElement* child = node->FirstChildElement(kind);
  while (child != nullptr && !child->Attribute(key, value)) {
    child = child->NextSiblingElement(kind);
  }
  return child;
}

std::string xmlAttribute(const tinyxml2::XMLElement* node, const char* key) {
  const tinyxml2::XMLElement* const attribute = xmlChild(node, "attr", "key", key);
  const char* const text = attribute == nullptr ? nullptr : attribute->GetText();
  return text == nullptr ? "" : text;
}

/// Returns the streams of events that the header's XML lists.
std::vector<Aedat4StreamInfo> streamsOf(std::string_view xml) {
  tinyxml2::XMLDocument document;
  if (document.Parse(xml.data(), xml.size()) != tinyxml2::XML_SUCCESS) {
    throw std::runtime_error(fmt::format("information of {} bytes, wrong in line {}: expected XML",
                                         xml.size(), document.ErrorLineNum()));
  }
  std::vector<Aedat4StreamInfo> streams;
  const tinyxml2::XMLElement* const out_info =
      xmlChild(document.FirstChildElement("dv"), "node", "name", "outInfo");
  if (out_info == nullptr) {
    throw std::runtime_error("no node 'outInfo': expected the list of streams");
  }
  for (const auto* node = out_info->FirstChildElement("node"); node != nullptr;
       node = node->NextSiblingElement("node")) {
    if (xmlAttribute(node, "typeIdentifier") != "EVTS") continue;
    const char* const name = node->Attribute("name");
    const auto id = parseNumber<std::int32_t>(name == nullptr ? "" : name);
    if (!id) throw std::runtime_error("a stream of events: expected a number as its name");
    const tinyxml2::XMLElement* const info = xmlChild(node, "node", "name", "info");
    Aedat4StreamInfo stream{*id, xmlAttribute(node, "originalOutputName"),
                            xmlAttribute(info, "source"), std::nullopt};
    stream.size = cameraSizeOf(xmlAttribute(info, "sizeX"), xmlAttribute(info, "sizeY"));
    streams.push_back(std::move(stream));
  }
  std::sort(streams.begin(), streams.end(),
            [](const auto& a, const auto& b) { return a.id < b.id; });
  return streams;
}

/// Grows `bytes` and calls `step(source, taken, target, given)` until the frame ends. `step`
/// replaces the sizes of both by the numbers of read and written bytes, and returns whether the
/// frame goes on.
template <typename Step>
void growWhile(const std::vector<std::uint8_t>& packed, std::vector<std::uint8_t>& bytes,
               const Step& step) {
  std::size_t read = 0;
  std::size_t written = 0;
  bytes.resize(std::max(bytes.size(), std::size_t{1} << 16U));
  while (true) {
    std::size_t taken = packed.size() - read;
    std::size_t given = bytes.size() - written;
    const bool goes_on = step(packed.data() + read, taken, bytes.data() + written, given);
    read += taken;
    written += given;
    if (!goes_on) break;
    if (written == bytes.size()) {
      if (written == kMaxAedat4Bytes) {
        throw std::runtime_error("decompressed data: expected at most 256 MiB");
      }
      bytes.resize(std::min(2 * written, kMaxAedat4Bytes));
    } else if (taken == 0 && given == 0) {
      throw std::runtime_error(
          fmt::format("compressed data of {} bytes: expected more", packed.size()));
    }
  }
  bytes.resize(written);
}

void decompressLz4Frame(const std::vector<std::uint8_t>& packed, std::vector<std::uint8_t>& bytes) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) != 0) {
    throw std::bad_alloc();
  }
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      made, &LZ4F_freeDecompressionContext);
  growWhile(
      packed, bytes,
      [&](const std::uint8_t* source, std::size_t& taken, std::uint8_t* target,
          std::size_t& given) {
        const std::size_t left =
            LZ4F_decompress(context.get(), target, &given, source, &taken, nullptr);
        if (LZ4F_isError(left) == 0) return left != 0;
        throw std::runtime_error(fmt::format("{}: expected an LZ4 frame", LZ4F_getErrorName(left)));
      });
}

void decompressZstdFrame(const std::vector<std::uint8_t>& packed,
                         std::vector<std::uint8_t>& bytes) {
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> context(ZSTD_createDStream(),
                                                                           &ZSTD_freeDStream);
  if (context == nullptr) throw std::bad_alloc();
  growWhile(packed, bytes,
            [&](const std::uint8_t* source, std::size_t& taken, std::uint8_t* target,
                std::size_t& given) {
              ZSTD_inBuffer in{source, taken, 0};
              ZSTD_outBuffer out{target, given, 0};
              const std::size_t left = ZSTD_decompressStream(context.get(), &out, &in);
              taken = in.pos;
              given = out.pos;
              if (ZSTD_isError(left) == 0) return left != 0;
              throw std::runtime_error(
                  fmt::format("{}: expected a Zstandard frame", ZSTD_getErrorName(left)));
            });
}

/// @throws std::runtime_error naming the file, the position and the expected value.
Aedat4Header readAedat4Header(const std::filesystem::path& file) {
  const auto fail = [&](std::uint64_t byte, const std::string& what) {
    return std::runtime_error(fmt::format("{}: byte {}: {}", file.string(), byte, what));
  };
  std::ifstream stream(file, std::ios::binary);
  if (!stream || !isFile(file)) {
    throw std::runtime_error(file.string() + ": cannot be opened for reading");
  }
  Aedat4Header header;
  header.file_size = std::filesystem::file_size(file);
  std::string magic(kAedat4Magic.size(), '\0');
  std::vector<std::uint8_t> bytes(sizeof(std::uint32_t));
  if (!stream.read(magic.data(), static_cast<std::streamsize>(magic.size())) ||
      magic != kAedat4Magic) {
    throw fail(0, "expected '#!AER-DAT4.0'");
  }
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  const auto size = numberFrom<std::uint32_t>(bytes.data(), false);
  const std::uint64_t begin = magic.size() + bytes.size();
  const std::uint64_t left = header.file_size - std::min(begin, header.file_size);
  if (!stream || size > left) {
    throw fail(magic.size(),
               fmt::format("a header of {} bytes: expected at most {}, up to the end", size, left));
  }
  bytes.resize(bytes.size() + size);
  stream.read(reinterpret_cast<char*>(bytes.data() + sizeof(std::uint32_t)),
              static_cast<std::streamsize>(size));
  if (!stream) throw fail(begin, "the header cannot be read");
  try {
    // table IOHeader { compression: int32; dataTablePosition: int64 = -1; infoNode: string; }
    const FlatTable table(bytes, "IOHE");
    header.compression = table.number(0, Aedat4Compression::kNone);
    if (header.compression < Aedat4Compression::kNone ||
        header.compression > Aedat4Compression::kZstdHigh) {
      throw std::runtime_error(
          fmt::format("compression = {}: expected 0 (none), 1 or 2 (LZ4), 3 or 4 (Zstandard)",
                      static_cast<std::int32_t>(header.compression)));
    }
    header.streams = streamsOf(table.text(2));
    header.packets_begin = begin + size;
    const auto index = static_cast<std::uint64_t>(table.number(1, std::int64_t{-1}));
    header.has_index = index >= header.packets_begin && index < header.file_size;
    header.packets_end = header.has_index ? index : header.file_size;
  } catch (const std::runtime_error& error) {
    throw fail(magic.size(), error.what());
  }
  return header;
}

/// Decompresses a packet or the index.
/// @param bytes replaced by the result, at most 256 MiB; memory grows with the existing data.
/// @throws std::runtime_error, without the file's name, at damaged data.
void decompressAedat4(Aedat4Compression compression, const std::vector<std::uint8_t>& packed,
                      std::vector<std::uint8_t>& bytes) {
  switch (compression) {
    case Aedat4Compression::kNone:
      bytes = packed;
      break;
    case Aedat4Compression::kLz4:
    case Aedat4Compression::kLz4High:
      decompressLz4Frame(packed, bytes);
      break;
    case Aedat4Compression::kZstd:
    case Aedat4Compression::kZstdHigh:
      decompressZstdFrame(packed, bytes);
      break;
  }
}

/// Returns the entries of the decompressed index.
/// @throws std::runtime_error, without the file's name, if the bytes are not an index.
std::vector<Aedat4IndexEntry> indexOfAedat4(const std::vector<std::uint8_t>& bytes) {
  // table FileDataTable { table: [FileDataDefinition]; }
  // table FileDataDefinition { byteOffset: int64; packetInfo: PacketHeader; numElements: int64;
  //                            timestampStart: int64; timestampEnd: int64; }
  // struct PacketHeader { stream: int32; size: int32; }
  const FlatTable root(bytes, "FTAB");
  const FlatTable::Elements entries = root.elements(0, sizeof(std::uint32_t));
  std::vector<Aedat4IndexEntry> index;
  index.reserve(entries.count);
  for (std::uint64_t i = 0; i < entries.count; ++i) {
    const FlatTable entry = root.element(entries, i);
    if (!entry.has(1)) continue;
    index.push_back({entry.number(0, std::uint64_t{0}), entry.number(1, std::int32_t{0}),
                     entry.number(4, std::int64_t{0})});
  }
  return index;
}

constexpr std::uint64_t kAedat4PacketHeaderBytes = 8;

bool isAedat4Named(const Aedat4StreamInfo& stream, const std::string& name) {
  return name == stream.name || name == stream.source || name == std::to_string(stream.id);
}

/// Returns the streams that `topics` names, in the order of the topics; all if it is empty.
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

  bool decode(std::vector<Event>& events) override {
    events.clear();
    if (!readPacket()) return false;
    FlatTable::Elements packet;  // not aligned
    try {
      decompressAedat4(header_->compression, packed_, flatbuffer_);
      // table EventPacket { elements: [Event]; }
      packet = FlatTable(flatbuffer_, "EVTS").elements(0, sizeof(Aedat4Event));
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(
          fmt::format("{}: byte {}: {}", file_.string(), packet_byte_, error.what()));
    }
    events.resize(packet.count);
    for (std::size_t i = 0; i < packet.count; ++i) {
      Aedat4Event from;
      std::memcpy(&from, flatbuffer_.data() + packet.position + i * sizeof(from), sizeof(from));
      constexpr std::int64_t kEndUs = kEndOfTimeNs / kNanosecondsPerMicrosecond;
      if (from.t_us >= kEndUs || from.t_us <= -kEndUs) {
        events.resize(i);
        throw std::runtime_error(fmt::format(
            "{}: t = '{}': expected a time in µs before the year 2116", positionOf(i), from.t_us));
      }
      events[i] = {from.t_us * kNanosecondsPerMicrosecond, static_cast<std::uint16_t>(from.x),
                   static_cast<std::uint16_t>(from.y), from.on != 0};
    }
    return true;
  }
  /// Uses the index at the end of the file. If the index is absent (the recording was interrupted)
  /// or does not fit the packets, it is not used.
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
      if (entry.last_us < t_ns / kNanosecondsPerMicrosecond) continue;
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
  std::uint64_t next_byte_ = 0;           // position of the next packet
  std::uint64_t packet_byte_ = 0;         // of the current packet
  std::vector<std::uint8_t> packed_;      // of the current packet
  std::vector<std::uint8_t> flatbuffer_;  // current packet, decompressed
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
