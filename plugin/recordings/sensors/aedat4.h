// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// What an AEDAT4 file begins with.
inline constexpr std::string_view kAedat4Magic = "#!AER-DAT4.0\r\n";

/// How the packets of an AEDAT4 file are compressed. The numbers are the file's.
enum class Aedat4Compression : std::int32_t { kNone, kLz4, kLz4High, kZstd, kZstdHigh };

/// An event in a packet, as the file has it.
struct Aedat4Event {
  std::int64_t t_us;  ///< Unix time.
  std::int16_t x;
  std::int16_t y;
  std::uint8_t on;
  std::uint8_t padding[3];
};
static_assert(sizeof(Aedat4Event) == 16);

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
