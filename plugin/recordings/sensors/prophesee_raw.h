// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "plugin/recordings/sensors/evt_decoder.h"
#include "plugin/recordings/streams/recording_parts.h"

namespace efm {

/// What the lines "% key value" at the beginning of a RAW file say.
struct RawHeader {
  EvtEncoding encoding = EvtEncoding::kEvt3;  ///< "% evt 3.0" or "% format EVT3;…"
  /// "% geometry 1280x720" or "% format …;height=720;…"; else of the camera that "% plugin_name" or
  /// "% system_ID" names, as files of 2020 have it.
  std::optional<CameraSize> size;
  std::uint64_t bytes = 0;  ///< Of the header; the words follow.
};

/// The events of a RAW file of a Prophesee camera. Times are those of the sensor's clock, see
/// EvtDecoder.
class PropheseeRawStream : public EventStream {
 public:
  explicit PropheseeRawStream(std::filesystem::path file);

  bool read(std::vector<Event>& events) override;
  /// Reads the file up to the time, but only its TIME_HIGH words (some GB/s): in EVT 3.0 no other
  /// way tells how often the clock wrapped.
  void seek(std::int64_t t_ns) override;
  std::string positionOf(std::size_t index) const override;
  std::string name() const override { return file_.string(); }
  double progress() const override;
  std::optional<CameraSize> size() const override { return header_.size; }
  /// The file has no gaps: only events at its beginning have no time.
  std::uint64_t undatedEvents() const override {
    return from_beginning_ ? decoder_.undatedEvents() : 0;
  }

 private:
  bool readBlock();
  std::string place(std::uint64_t byte) const;

  std::filesystem::path file_;
  std::ifstream stream_;
  std::uint64_t bytes_total_ = 0;
  RawHeader header_;
  EvtDecoder decoder_;
  bool from_beginning_ = true;
  EvtDecoder at_block_;  // the decoder before the block
  std::vector<std::uint8_t> block_;
  std::uint64_t block_byte_ = 0;  // the position of the block in the file
};

/// Whether a file begins with the header of a RAW file with EVT words.
bool looksLikePropheseeRaw(const std::filesystem::path& file);

/// Each file is a camera.
RecordingParts openPropheseeRaw(const std::vector<std::filesystem::path>& files,
                                const ReaderOptions& options);

}  // namespace efm
