// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plugin/recordings/sensors/aedat4_container.h"
#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// A stream of events of an AEDAT4 file (iniVation). A block is a packet. Times are Unix time.
class Aedat4Stream : public EventStream {
 public:
  /// @param stream one of `header->streams`.
  Aedat4Stream(std::filesystem::path file, std::shared_ptr<const Aedat4Header> header,
               Aedat4StreamInfo stream);

  bool read(std::vector<Event>& events) override;
  /// By the index at the end of the file. An index that is absent (the recording was interrupted)
  /// or does not fit the packets is not used.
  void seek(std::int64_t t_ns) override;
  std::string positionOf(std::size_t index) const override;
  std::string name() const override { return file_.string(); }
  double progress() const override;
  std::optional<CameraSize> size() const override { return info_.size; }

 private:
  bool readPacket();
  std::int32_t nextInt32();

  std::filesystem::path file_;
  std::shared_ptr<const Aedat4Header> header_;
  Aedat4StreamInfo info_;
  std::ifstream stream_;
  std::uint64_t next_byte_ = 0;           // of the next packet
  std::uint64_t packet_byte_ = 0;         // of the current packet
  std::vector<std::uint8_t> packed_;      // of the current packet
  std::vector<std::uint8_t> flatbuffer_;  // of the current packet, decompressed
};

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
