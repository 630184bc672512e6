// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/recordings/open/rawlog_writer.h"

#include <mrpt/serialization/CArchive.h>

#include <stdexcept>

#include "plugin/mrpt/CObservationEvents.h"
#include "plugin/recordings/open/gz_stream.h"

namespace efm {

RawlogWriter::RawlogWriter(const std::filesystem::path& file, RawlogCompression compression)
    : file_(file),
      compression_(compression),
      stream_(std::make_unique<GzOutputStream>(file_.temporary(),
                                               compression == RawlogCompression::kGzip)) {}

RawlogWriter::~RawlogWriter() = default;

void RawlogWriter::write(mrpt::obs::CObservation& observation) {
  if (auto* packet = dynamic_cast<CObservationEvents*>(&observation)) {
    packet->compression = compression_ == RawlogCompression::kZstd ? EventCompression::kZstd
                                                                   : EventCompression::kNone;
  }
  try {
    auto archive = mrpt::serialization::archiveFrom<mrpt::io::CStream>(*stream_);
    archive << observation;
  } catch (const std::exception& error) {
    throw std::runtime_error(file_.path().string() + ": cannot be written: " + error.what());
  }
}

void RawlogWriter::close() {
  try {
    stream_->close();
    file_.replace();
    stream_.reset();
  } catch (const std::exception& error) {
    throw std::runtime_error(file_.path().string() + ": " + error.what());
  }
}

}  // namespace efm
