// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/bags/bag_chunks.h"

#include <bzlib.h>
#include <fmt/format.h>
#include <lz4frame.h>
#include <zstd.h>

#include <new>

#include "mapping/base/text.h"

namespace efm {
namespace {

constexpr std::uint64_t kMaxChunkBytes = std::uint64_t{1} << 30;
constexpr std::size_t kRecentBytes = 8 << 20;  // size of the chunks that are kept

/// @return the number of bytes in `target`.
std::size_t decompressLz4(const std::uint8_t* data, std::size_t size, std::uint8_t* target,
                          std::size_t capacity) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) {
    throw std::bad_alloc();
  }
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> owner(
      context, &LZ4F_freeDecompressionContext);
  std::size_t written = 0;
  while (size > 0) {
    std::size_t taken = size;
    std::size_t given = capacity - written;
    const std::size_t expected =
        LZ4F_decompress(context, target + written, &given, data, &taken, nullptr);
    if (LZ4F_isError(expected) != 0) throw std::runtime_error(LZ4F_getErrorName(expected));
    if (taken == 0 && given == 0) throw std::runtime_error("more bytes than claimed");
    data += taken;
    size -= taken;
    written += given;
  }
  return written;
}

std::size_t decompressTo(ChunkCompression compression, const std::uint8_t* data, std::size_t size,
                         std::uint8_t* target, std::size_t capacity) {
  switch (compression) {
    case ChunkCompression::kNone:
      break;
    case ChunkCompression::kLz4:
      return decompressLz4(data, size, target, capacity);
    case ChunkCompression::kBz2: {
      auto written = static_cast<unsigned int>(capacity);
      auto* const source = const_cast<char*>(reinterpret_cast<const char*>(data));
      const int status =
          BZ2_bzBuffToBuffDecompress(reinterpret_cast<char*>(target), &written, source,
                                     static_cast<unsigned int>(size), /*small=*/0, 0);
      if (status == BZ_MEM_ERROR) throw std::bad_alloc();
      if (status != BZ_OK) throw std::runtime_error(fmt::format("bzip2 error {}", status));
      return written;
    }
    case ChunkCompression::kZstd: {
      const std::size_t written = ZSTD_decompress(target, capacity, data, size);
      if (ZSTD_isError(written) != 0) throw std::runtime_error(ZSTD_getErrorName(written));
      return written;
    }
  }
  return 0;
}

}  // namespace

ChunkCompression chunkCompression(std::string_view name,
                                  std::initializer_list<std::string_view> known) {
  if (std::find(known.begin(), known.end(), name) == known.end()) {
    throw std::runtime_error(
        fmt::format("compression = {}: expected '{}'", inQuotes(name), fmt::join(known, "', '")));
  }
  if (name == "bz2") return ChunkCompression::kBz2;
  if (name == "lz4") return ChunkCompression::kLz4;
  if (name == "zstd") return ChunkCompression::kZstd;
  return ChunkCompression::kNone;
}

ChunkBytes unpackChunk(ChunkCompression compression, ChunkBytes packed, std::uint64_t claimed) {
  if (claimed > kMaxChunkBytes) {
    throw std::runtime_error(fmt::format("a chunk of {} bytes: expected at most 1 GiB", claimed));
  }
  ChunkBytes bytes = std::move(packed);
  if (compression != ChunkCompression::kNone) {
    // The memory has no initial values: pages that are not written take no memory.
    std::unique_ptr<std::uint8_t[]> memory(new std::uint8_t[std::max<std::uint64_t>(claimed, 1)]);
    try {
      bytes.size = decompressTo(compression, bytes.data, bytes.size, memory.get(), claimed);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("a damaged chunk ({}): expected {} bytes of messages",
                                           error.what(), claimed));
    }
    bytes.memory = std::move(memory);
    bytes.data = bytes.memory.get();
  }
  if (bytes.size != claimed) {
    throw std::runtime_error(
        fmt::format("a chunk with {} bytes of messages: expected {}", bytes.size, claimed));
  }
  return bytes;
}

ChunkedBag::ChunkedBag(std::filesystem::path file, std::string_view repair)
    : BagSource(std::move(file)), repair_(repair), stream_(this->file(), std::ios::binary) {
  if (!stream_) throw std::runtime_error(this->file().string() + ": cannot be opened for reading");
  file_size_ = std::filesystem::file_size(this->file());
}

/// Reads the chunks that have the topic, one after the other.
BagCursor ChunkedBag::messages(std::size_t topic, std::int64_t from_log_ns) {
  bool begun = false;  // true after the first message
  std::size_t next_chunk = 0;
  std::shared_ptr<const ChunkMessages> chunk;
  std::size_t next_message = 0;
  return [=](BagMessage& message) mutable {
    const auto is_wanted = [&](const BagChunk& entry) {
      return (entry.topics & topicBit(topic)) != 0 && (begun || entry.last_log_ns >= from_log_ns);
    };
    while (true) {
      while (chunk && next_message < chunk->messages.size()) {
        const ChunkMessages::Message& found = chunk->messages[next_message++];
        if (found.topic != topic || (!begun && found.log_ns < from_log_ns)) continue;
        begun = true;
        message = found;
        return true;
      }
      chunk.reset();
      while (next_chunk < chunks_.size() && !is_wanted(chunks_[next_chunk])) ++next_chunk;
      if (next_chunk == chunks_.size()) return false;
      chunk = chunkAt(next_chunk++);
      next_message = 0;
    }
  };
}

void ChunkedBag::setChunks(std::vector<BagChunk> chunks) {
  chunks_ = std::move(chunks);
  const BagChunk* first = nullptr;
  const BagChunk* last = nullptr;
  for (const BagChunk& chunk : chunks_) {
    if (chunk.topics == 0) continue;
    if (first == nullptr || chunk.first_log_ns < first->first_log_ns) first = &chunk;
    if (last == nullptr || chunk.last_log_ns > last->last_log_ns) last = &chunk;
  }
  if (first != nullptr) setLogTimes(first->first_log_ns, last->last_log_ns);
}

/// Keeps recent chunks: cameras are read in turns, some chunks apart.
std::shared_ptr<const ChunkMessages> ChunkedBag::chunkAt(std::size_t index) {
  const auto found = std::find_if(recent_.begin(), recent_.end(),
                                  [&](const auto& entry) { return entry.first == index; });
  if (found != recent_.end()) return found->second;
  auto chunk = std::make_shared<const ChunkMessages>(readChunk(chunks_[index]));
  recent_.emplace_back(index, chunk);
  std::size_t bytes = 0;
  for (const auto& entry : recent_) bytes += entry.second->bytes.size;
  while (!recent_.empty() && bytes > kRecentBytes) {
    bytes -= recent_.front().second->bytes.size;
    recent_.pop_front();
  }
  return chunk;
}

std::unique_ptr<std::uint8_t[]> ChunkedBag::readBytes(std::uint64_t offset, std::uint64_t size) {
  if (offset > file_size_ || size > file_size_ - offset) {
    throw errorAt(offset, fmt::format("a record of {} bytes: expected its end within the file of "
                                      "{} bytes, which may be cut off",
                                      size, file_size_));
  }
  if (size > kMaxChunkBytes) {
    throw errorAt(offset, fmt::format("a record of {} bytes: expected at most 1 GiB", size));
  }
  std::unique_ptr<std::uint8_t[]> bytes(new std::uint8_t[std::max<std::uint64_t>(size, 1)]);
  stream_.clear();
  stream_.seekg(static_cast<std::streamoff>(offset));
  if (!stream_.read(reinterpret_cast<char*>(bytes.get()), static_cast<std::streamsize>(size))) {
    throw errorAt(offset, fmt::format("cannot be read: expected {} bytes", size));
  }
  return bytes;
}

std::runtime_error ChunkedBag::errorAt(std::uint64_t offset, const std::string& what) const {
  return std::runtime_error(
      fmt::format("{}: byte {}: {}{}", file().string(), offset, what, repair_));
}

}  // namespace efm
