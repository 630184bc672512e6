// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <fstream>
#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "plugin/recordings/bags/bag_source.h"

namespace efm {

/// Where a chunk of messages lies in a bag.
struct BagChunk {
  std::uint64_t offset = 0;  ///< Of the chunk's record in the file, in bytes.
  std::uint64_t size = 0;    ///< Of the record. May reach beyond a damaged file.
  std::int64_t first_log_ns = 0;
  std::int64_t last_log_ns = 0;
  /// `topicBit` of each topic that has messages in it.
  std::uint64_t topics = ~std::uint64_t{0};
};

/// Topics from the 64th on share a bit.
inline std::uint64_t topicBit(std::size_t topic) {
  constexpr std::size_t kLastBit = 63;
  return std::uint64_t{1} << std::min(topic, kLastBit);
}

/// Bytes of a chunk, and the memory that they lie in.
struct ChunkBytes {
  std::unique_ptr<std::uint8_t[]> memory;
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
};

/// The messages of a chunk, decompressed.
struct ChunkMessages {
  struct Message : BagMessage {
    std::size_t topic;
  };
  ChunkBytes bytes;
  std::vector<Message> messages;  // in the order of the file; refer to `bytes`
};

/// A bag whose file is a sequence of chunks, each compressed by itself: ROS 1 bags and MCAP. Memory
/// holds the list of chunks, the last ones that were read (8 MiB) and one chunk for each cursor.
class ChunkedBag : public BagSource {
 public:
  BagCursor messages(std::size_t topic, std::int64_t from_log_ns) override;

 protected:
  /// @param repair what damaged bags of this kind are repaired with, for errors; may be empty.
  explicit ChunkedBag(std::filesystem::path file, std::string_view repair = {});

  virtual ChunkMessages readChunk(const BagChunk& chunk) = 0;

  /// @throws std::runtime_error where the file ends earlier, before memory is allocated.
  /// At most 1 GiB.
  std::unique_ptr<std::uint8_t[]> readBytes(std::uint64_t offset, std::uint64_t size);
  std::uint64_t fileSize() const { return file_size_; }
  void setChunks(std::vector<BagChunk> chunks);
  /// An error at a byte of the file: "a.bag: byte 4117: …".
  std::runtime_error errorAt(std::uint64_t offset, const std::string& what) const;
  /// Calls `read`; its errors become those of a byte of the file.
  template <typename Read>
  auto located(std::uint64_t offset, const Read& read) const {
    try {
      return read();
    } catch (const std::runtime_error& error) {
      throw errorAt(offset, error.what());
    }
  }

 private:
  std::shared_ptr<const ChunkMessages> chunkAt(std::size_t index);

  std::string_view repair_;
  std::ifstream stream_;
  std::uint64_t file_size_ = 0;
  std::vector<BagChunk> chunks_;
  /// The last chunks that were read, with their index in `chunks_`.
  std::deque<std::pair<std::size_t, std::shared_ptr<const ChunkMessages>>> recent_;
};

enum class ChunkCompression { kNone, kBz2, kLz4, kZstd };

/// @param known the names that the format has: "none" or "", "bz2", "lz4", "zstd".
/// @throws std::runtime_error, without the file's name, where the name is not one of them.
ChunkCompression chunkCompression(std::string_view name,
                                  std::initializer_list<std::string_view> known);

/// Decompresses a chunk.
/// @param claimed its size when decompressed, at most 1 GiB. Memory is used only as far as there
/// are bytes for it.
/// @return `claimed` bytes.
/// @throws std::runtime_error, without the file's name, where the data are damaged or have another
/// size.
ChunkBytes unpackChunk(ChunkCompression compression, ChunkBytes packed, std::uint64_t claimed);

}  // namespace efm
