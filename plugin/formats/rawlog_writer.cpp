// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/formats/rawlog_writer.h"

#include <mrpt/serialization/CArchive.h>

#include <stdexcept>
#include <system_error>

#include "maps/io/atomic_file.h"
#include "plugin/formats/gz_stream.h"

namespace efm {

RawlogWriter::RawlogWriter(const std::filesystem::path& file)
    : file_(replaceableFile(file)),
      temporary_(temporaryName(file_)),
      stream_(std::make_unique<GzOutputStream>(temporary_)) {}

RawlogWriter::~RawlogWriter() {
  if (!stream_) return;
  stream_.reset();
  std::error_code ignored;  // nothing more can be done here
  std::filesystem::remove(temporary_, ignored);
}

void RawlogWriter::write(const mrpt::obs::CObservation& observation) {
  try {
    auto archive = mrpt::serialization::archiveFrom<mrpt::io::CStream>(*stream_);
    archive << observation;
  } catch (const std::exception& error) {
    throw std::runtime_error(file_.string() + ": cannot be written: " + error.what());
  }
}

void RawlogWriter::close() {
  try {
    stream_->close();
    std::filesystem::rename(temporary_, file_);
    stream_.reset();
  } catch (const std::exception& error) {
    throw std::runtime_error(file_.string() + ": " + error.what());
  }
}

}  // namespace efm
