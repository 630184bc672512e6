// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// The first bytes of an AEDAT4 file.
inline constexpr std::string_view kAedat4Magic = "#!AER-DAT4.0\r\n";

/// The compression of packets in an AEDAT4 file. The values are those in the file.
enum class Aedat4Compression : std::int32_t { kNone, kLz4, kLz4High, kZstd, kZstdHigh };

/// An event in a packet, as stored in the file.
struct Aedat4Event {
  std::int64_t t_us;  ///< Unix time.
  std::int16_t x;
  std::int16_t y;
  std::uint8_t on;
  std::uint8_t padding[3];
};
static_assert(sizeof(Aedat4Event) == 16);

bool looksLikeAedat4(const std::filesystem::path& file);

/// Opens files. Each stream of events is a camera, in the order of the files and, within a file, of
/// the streams' numbers. `options.topics` chooses streams by the name of their output, their camera
/// or their number; the cameras are then in the order of the topics.
/// @throws std::runtime_error naming the file, the position and the expected value; also if this
/// build does not read AEDAT4.
RecordingParts openAedat4(const std::vector<std::filesystem::path>& files,
                          const ReaderOptions& options);

}  // namespace efm
