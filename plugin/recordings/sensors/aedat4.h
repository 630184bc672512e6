// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "plugin/recordings/calibration/calibration_file.h"
#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// What an AEDAT4 file begins with.
inline constexpr std::string_view kAedat4Magic = "#!AER-DAT4.0\r\n";

/// How the packets of an AEDAT4 file are compressed. The numbers are the file's.
enum class Aedat4Compression : std::int32_t { kNone, kLz4, kLz4High, kZstd, kZstdHigh };

/// A stream of events that the header of an AEDAT4 file lists.
struct Aedat4StreamInfo {
  std::int32_t id = 0;
  std::string name;    ///< The module's output: "events".
  std::string source;  ///< The camera: "DVXplorer_DXA00093".
  std::optional<CameraSize> size;
};

/// The header of an AEDAT4 file.
struct Aedat4Header {
  Aedat4Compression compression = Aedat4Compression::kNone;
  std::uint64_t packets_begin = 0;  ///< The byte of the first packet.
  std::uint64_t packets_end = 0;    ///< The byte behind the last packet.
  bool has_index = false;           ///< It is between `packets_end` and the end of the file.
  std::uint64_t file_size = 0;
  std::vector<Aedat4StreamInfo> streams;  ///< With events (EVTS), in the order of their numbers.
};

/// An event in a packet, as the file has it.
struct Aedat4Event {
  std::int64_t t_us;  ///< Unix time.
  std::int16_t x;
  std::int16_t y;
  std::uint8_t on;
  std::uint8_t padding[3];
};
static_assert(sizeof(Aedat4Event) == 16);

/// Where a packet lies, as the index at the end of the file has it.
struct Aedat4IndexEntry {
  std::uint64_t byte = 0;  ///< Of the packet's data, which follow 8 bytes of stream and size.
  std::int32_t stream = 0;
  std::int64_t last_us = 0;  ///< The time of the last event.
};

/// @throws std::runtime_error naming the file, the position and what was expected.
Aedat4Header readAedat4Header(const std::filesystem::path& file);

/// Decompresses a packet or the index.
/// @param bytes is replaced by at most 256 MiB; memory grows with the bytes that there are.
/// @throws std::runtime_error, without the file's name, at damaged data.
void decompressAedat4(Aedat4Compression compression, const std::vector<std::uint8_t>& packed,
                      std::vector<std::uint8_t>& bytes);

/// The events of a decompressed packet: a view of `count` times an Aedat4Event, not aligned.
struct Aedat4Events {
  const std::uint8_t* begin = nullptr;
  std::size_t count = 0;
};
/// @throws std::runtime_error, without the file's name, where the bytes are not a packet of events.
Aedat4Events eventsOfAedat4(const std::vector<std::uint8_t>& bytes);

/// The entries of the decompressed index.
/// @throws std::runtime_error, without the file's name, where the bytes are not an index.
std::vector<Aedat4IndexEntry> indexOfAedat4(const std::vector<std::uint8_t>& bytes);

/// Whether a file begins like an AEDAT4 file.
bool looksLikeAedat4(const std::filesystem::path& file);

/// Each stream of events is a camera, in the order of the streams' numbers; of several files, in
/// the order of the files. `options.topics` chooses among streams by the name of their output,
/// their camera or their number; cameras are then in its order.
/// @throws std::runtime_error naming the file, the position and what was expected; also where this
/// build does not read AEDAT4.
RecordingParts openAedat4(const std::vector<std::filesystem::path>& files,
                          const ReaderOptions& options);

}  // namespace efm
