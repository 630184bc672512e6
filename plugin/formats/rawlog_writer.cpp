// SPDX-License-Identifier: BSD-3-Clause
#include "plugin/formats/rawlog_writer.h"

#include <mrpt/serialization/CArchive.h>

#include <stdexcept>

#include "plugin/formats/gz_stream.h"

namespace efm {

RawlogWriter::RawlogWriter(const std::filesystem::path& file)
    : file_(file), stream_(std::make_unique<GzOutputStream>(file_.temporary())) {}

RawlogWriter::~RawlogWriter() = default;

void RawlogWriter::write(const mrpt::obs::CObservation& observation) {
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
