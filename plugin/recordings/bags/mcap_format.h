// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace efm {

/// MCAP files (mcap.dev/spec), for the reader and the writer: a magic word, records and the magic
/// word again. A record is its op, a size of 64 bits and its content; numbers are little-endian.

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

inline constexpr std::size_t kMcapRecordHead = 9;      // op and size
inline constexpr std::size_t kMcapFooterContent = 20;  // summary, summary offsets, checksum

}  // namespace efm
