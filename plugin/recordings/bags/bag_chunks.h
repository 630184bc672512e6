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

/// The position of a chunk of messages in a bag.
struct BagChunk {
  std::uint64_t offset = 0;  ///< Position of the chunk's record in the file, in bytes.
  std::uint64_t size = 0;    ///< Size of the record. It may exceed a damaged file.
  std::int64_t first_log_ns = 0;
  std::int64_t last_log_ns = 0;
  /// The bits (`topicBit`) of the topics with messages in the chunk.
  std::uint64_t topics = ~std::uint64_t{0};
};

/// Returns the bit of a topic. Topics from the 64th on share a bit.
inline std::uint64_t topicBit(std::size_t topic) {
  constexpr std::size_t kLastBit = 63;
  return std::uint64_t{1} << std::min(topic, kLastBit);
}

/// The bytes of a chunk and the memory that owns them.
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
/// holds the list of chunks, the last chunks that were read (8 MiB) and one chunk for each cursor.
class ChunkedBag : public BagSource {
 public:
  BagCursor messages(std::size_t topic, std::int64_t from_log_ns) override;

 protected:
  /// @param repair text for errors about the repair of damaged bags; may be empty.
  explicit ChunkedBag(std::filesystem::path file, std::string_view repair = {});

  virtual ChunkMessages readChunk(const BagChunk& chunk) = 0;

  /// Reads at most 1 GiB. @throws std::runtime_error, before memory is allocated, if the file is
  /// shorter.
  std::unique_ptr<std::uint8_t[]> readBytes(std::uint64_t offset, std::uint64_t size);
  std::uint64_t fileSize() const { return file_size_; }
  void setChunks(std::vector<BagChunk> chunks);
  /// Makes an error at a byte of the file: "a.bag: byte 4117: …".
  std::runtime_error errorAt(std::uint64_t offset, const std::string& what) const;
  /// Calls `read`, and adds the byte of the file to its errors.
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

/// @param known the names that the format allows: "none" or "", "bz2", "lz4", "zstd".
/// @throws std::runtime_error, without the file's name, if the name is not known.
ChunkCompression chunkCompression(std::string_view name,
                                  std::initializer_list<std::string_view> known);

/// @param claimed size when decompressed, at most 1 GiB. Memory is used only for bytes that exist.
/// @return `claimed` bytes.
/// @throws std::runtime_error, without the file's name, if the data are damaged or have another
/// size.
ChunkBytes unpackChunk(ChunkCompression compression, ChunkBytes packed, std::uint64_t claimed);

}  // namespace efm
