// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/io/CStream.h>
#include <mrpt/obs/CObservation.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>

#include "plugin/recordings/open/mrpt_library.h"

struct gzFile_s;  // of zlib

namespace efm {

/// A gzip file, with MRPT's compression level, 1, or a plain file, as an MRPT stream. A truncated
/// file is an error, and so is a full disk: mrpt::io's own streams notice neither.
class GzStream : public mrpt::io::CStream {
 public:
  enum class Mode { kRead, kWrite, kWritePlain };
  explicit GzStream(const std::filesystem::path& file, Mode mode = Mode::kRead);

  /// @throws std::runtime_error if the file is truncated or its compression is damaged.
  bool atEnd();
  /// The fraction of the file that has been read, 0 to 1.
  double progress() const;
  /// Completes a file that is written.
  void close();

  /// @return less than `count` only at the end.
  /// @throws std::runtime_error as `atEnd`.
  std::size_t Read(void* buffer, std::size_t count) override;
  std::size_t Write(const void* buffer, std::size_t count) override;
  std::uint64_t Seek(std::int64_t offset, TSeekOrigin origin) override;  ///< Throws: forward only.
  std::uint64_t getTotalBytesCount() const override;                     ///< Throws: not known.
  std::uint64_t getPosition() const override;

 private:
  std::unique_ptr<gzFile_s, int (*)(gzFile_s*)> file_;
  std::uint64_t file_size_ = 0;  // of one that is read
};

/// Reads a rawlog, gzip-compressed or plain. Cameras are in the order of their indices. The
/// movements of actions are composed to poses (see DeadReckoning), which come before the next
/// frame; of several poses with the same time only the last. Other actions and comments are
/// ignored. The file is read once for poses and cameras, and then once for each stream.
///
/// An error, "stopped at entry N of FILE: reason", is that of a truncated or damaged file, or of an
/// unknown class. Entries count from 0, as in MRPT's programs. All entries before N are read.
RecordingParts openRawlog(const std::filesystem::path& file, const ReaderOptions& options);

/// A sample as MRPT has it. One from a rawlog keeps what it had there: labels, covariances, the
/// digits of poses.
mrpt::obs::CObservation::Ptr observationOf(Sample sample);

/// Writes a rawlog that MRPT's own programs read. The file gets its name when it is complete.
std::unique_ptr<RawlogWriter> writeRawlog(const std::filesystem::path& file,
                                          RawlogCompression compression);

}  // namespace efm
