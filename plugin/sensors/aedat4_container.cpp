// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/sensors/aedat4_container.h"

#include <flatbuffers/flatbuffers.h>
#include <fmt/format.h>
#include <lz4frame.h>
#include <tinyxml2.h>
#include <zstd.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <new>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "mapping/options/text_parsing.h"
#include "plugin/streams/source_files.h"

namespace efm {
namespace {

constexpr std::size_t kMaxAedat4Bytes = std::size_t{1} << 28U;

// FlatBuffers as their schemas define them. A field's number is 4 + 2 * its index. The verifier
// asks for the name Verify. NOLINTBEGIN(readability-identifier-naming)

/// table IOHeader { compression: int32; dataTablePosition: int64 = -1; infoNode: string; }
class Aedat4HeaderTable : private flatbuffers::Table {
 public:
  std::int32_t compression() const { return GetField<std::int32_t>(4, 0); }
  std::int64_t indexByte() const { return GetField<std::int64_t>(6, -1); }
  const flatbuffers::String* info() const { return GetPointer<const flatbuffers::String*>(8); }
  bool Verify(flatbuffers::Verifier& verifier) const {
    return VerifyTableStart(verifier) && VerifyField<std::int32_t>(verifier, 4, 4) &&
           VerifyField<std::int64_t>(verifier, 6, 8) && VerifyOffset(verifier, 8) &&
           verifier.VerifyString(info()) && verifier.EndTable();
  }
};

/// table EventPacket { elements: [Event]; }
class Aedat4EventsTable : private flatbuffers::Table {
 public:
  using Events = flatbuffers::Vector<const Aedat4Event*>;
  const Events* events() const { return GetPointer<const Events*>(4); }
  bool Verify(flatbuffers::Verifier& verifier) const {
    return VerifyTableStart(verifier) && VerifyOffset(verifier, 4) &&
           verifier.VerifyVector(events()) && verifier.EndTable();
  }
};

struct Aedat4PacketHeader {
  std::int32_t stream;
  std::int32_t size;
};

/// table FileDataDefinition { byteOffset: int64; packetInfo: PacketHeader; numElements: int64;
///                            timestampStart: int64; timestampEnd: int64; }
class Aedat4IndexEntryTable : private flatbuffers::Table {
 public:
  std::int64_t byte() const { return GetField<std::int64_t>(4, 0); }
  const Aedat4PacketHeader* packet() const { return GetStruct<const Aedat4PacketHeader*>(6); }
  std::int64_t lastUs() const { return GetField<std::int64_t>(12, 0); }
  bool Verify(flatbuffers::Verifier& verifier) const {
    return VerifyTableStart(verifier) && VerifyField<std::int64_t>(verifier, 4, 8) &&
           VerifyField<Aedat4PacketHeader>(verifier, 6, 4) &&
           VerifyField<std::int64_t>(verifier, 12, 8) && verifier.EndTable();
  }
};

/// table FileDataTable { table: [FileDataDefinition]; }
class Aedat4IndexTable : private flatbuffers::Table {
 public:
  using Entries = flatbuffers::Vector<flatbuffers::Offset<Aedat4IndexEntryTable>>;
  const Entries* entries() const { return GetPointer<const Entries*>(4); }
  bool Verify(flatbuffers::Verifier& verifier) const {
    return VerifyTableStart(verifier) && VerifyOffset(verifier, 4) &&
           verifier.VerifyVector(entries()) && verifier.VerifyVectorOfTables(entries()) &&
           verifier.EndTable();
  }
};

// NOLINTEND(readability-identifier-naming)

/// The root of a FlatBuffer that begins with its size.
template <typename Table>
const Table& flatbufferRoot(const std::vector<std::uint8_t>& bytes, const char* identifier) {
  flatbuffers::Verifier::Options options;
  options.max_tables = static_cast<flatbuffers::uoffset_t>(bytes.size() / 4);
  flatbuffers::Verifier verifier(bytes.data(), bytes.size(), options);
  if (!verifier.VerifySizePrefixedBuffer<Table>(identifier)) {
    throw std::runtime_error(
        fmt::format("{} bytes: expected a FlatBuffer '{}' of this size", bytes.size(), identifier));
  }
  return *flatbuffers::GetSizePrefixedRoot<Table>(bytes.data());
}

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
std::vector<Aedat4StreamInfo> streamsOf(const std::string& xml) {
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
    const auto width = parseNumber<int>(xmlAttribute(info, "sizeX"));
    const auto height = parseNumber<int>(xmlAttribute(info, "sizeY"));
    constexpr int kMaxSide = 65'535;
    if (width && height && std::min(*width, *height) > 0 && std::max(*width, *height) <= kMaxSide) {
      stream.size = CameraSize{*width, *height};
    }
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
  const std::uint64_t size = flatbuffers::ReadScalar<std::uint32_t>(bytes.data());
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
    const Aedat4HeaderTable& table = flatbufferRoot<Aedat4HeaderTable>(bytes, "IOHE");
    header.compression = static_cast<Aedat4Compression>(table.compression());
    if (header.compression < Aedat4Compression::kNone ||
        header.compression > Aedat4Compression::kZstdHigh) {
      throw std::runtime_error(
          fmt::format("compression = {}: expected 0 (none), 1 or 2 (LZ4), 3 or 4 (Zstandard)",
                      table.compression()));
    }
    header.streams = streamsOf(table.info() == nullptr ? "" : table.info()->str());
    header.packets_begin = begin + size;
    const auto index = static_cast<std::uint64_t>(table.indexByte());
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
  const Aedat4EventsTable::Events* const events =
      flatbufferRoot<Aedat4EventsTable>(bytes, "EVTS").events();
  if (events == nullptr || events->size() == 0) return {};
  return {events->Get(0), events->size()};
}

std::vector<Aedat4IndexEntry> indexOfAedat4(const std::vector<std::uint8_t>& bytes) {
  std::vector<Aedat4IndexEntry> index;
  const Aedat4IndexTable::Entries* const entries =
      flatbufferRoot<Aedat4IndexTable>(bytes, "FTAB").entries();
  if (entries == nullptr) return index;
  index.reserve(entries->size());
  for (const Aedat4IndexEntryTable* entry : *entries) {
    if (entry->packet() == nullptr) continue;
    index.push_back(
        {static_cast<std::uint64_t>(entry->byte()), entry->packet()->stream, entry->lastUs()});
  }
  return index;
}

}  // namespace efm
