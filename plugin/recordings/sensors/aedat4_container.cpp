// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/sensors/aedat4.h"

#include <fmt/format.h>
#include <lz4frame.h>
#include <tinyxml2.h>
#include <zstd.h>

#include <algorithm>
#include <new>
#include <stdexcept>
#include <utility>

#include "mapping/base/number_bytes.h"
#include "mapping/base/text.h"
#include "plugin/recordings/streams/time_unit.h"

namespace efm {
namespace {

constexpr std::size_t kMaxAedat4Bytes = std::size_t{1} << 28U;

/// A table of a FlatBuffer. Its values may lie at any byte: writers in other languages than C++
/// align them to another beginning. So each value is copied, at a position that is checked.
class FlatTable {
 public:
  /// The root of a FlatBuffer behind its size in 4 bytes. Refers to `bytes`.
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
  /// Where the elements of a vector lie; none if the table has no such field.
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
  /// A table of a vector of tables.
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
  /// A list before or behind the table has the fields' positions: 0 or missing of absent ones.
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

/// A child <node name="…"> or <attr key="…"> of a node; null if there is none.
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

/// The streams of events that the header's XML lists.
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

/// Grows `bytes` and calls `step(source, size, target, capacity)` until it says that the frame has
/// ended. `step` moves the four values, and returns whether the frame goes on.
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

}  // namespace

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

Aedat4Events eventsOfAedat4(const std::vector<std::uint8_t>& bytes) {
  // table EventPacket { elements: [Event]; }
  const auto events = FlatTable(bytes, "EVTS").elements(0, sizeof(Aedat4Event));
  return {bytes.data() + events.position, events.count};
}

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

}  // namespace efm
