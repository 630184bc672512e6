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
/// file and a full disk are errors: mrpt::io's own streams notice neither.
class GzStream : public mrpt::io::CStream {
 public:
  enum class Mode { kRead, kWrite, kWritePlain };
  explicit GzStream(const std::filesystem::path& file, Mode mode = Mode::kRead);

  /// @throws std::runtime_error if the file is truncated or its compression is damaged.
  bool atEnd();
  /// Returns the fraction of the file that has been read, 0 to 1.
  double progress() const;
  /// Completes the written file.
  void close();

  /// @return the number of bytes; it is less than `count` only at the end of the file.
  /// @throws std::runtime_error if the file is truncated or its compression is damaged.
  std::size_t Read(void* buffer, std::size_t count) override;
  std::size_t Write(const void* buffer, std::size_t count) override;
  std::uint64_t Seek(std::int64_t offset, TSeekOrigin origin) override;  ///< Throws: forward only.
  std::uint64_t getTotalBytesCount() const override;                     ///< Throws: not known.
  std::uint64_t getPosition() const override;

 private:
  std::unique_ptr<gzFile_s, int (*)(gzFile_s*)> file_;
  std::uint64_t file_size_ = 0;  // of a file that is read
};

/// Opens a rawlog, gzip-compressed or plain. Cameras are in the order of their indices. The
/// movements of actions are composed to poses (see DeadReckoning), which come before the next
/// frame. If several of these poses have the same time, only the last is kept. Other actions and
/// comments are ignored. The file is read for poses and cameras, and once more for all streams.
///
/// The error "stopped at entry N of FILE: reason" means a truncated or damaged file, or an unknown
/// class. Entries are counted from 0, as in MRPT's programs. All entries before N are read.
RecordingParts openRawlog(const std::filesystem::path& file, const ReaderOptions& options);

/// Writes samples of a recording, which must live longer, as a rawlog for MRPT's own programs. The
/// file gets its name when it is complete. A sample from a rawlog keeps the labels, the covariances
/// and the digits of poses that it had there.
std::unique_ptr<RawlogWriter> writeRawlog(const std::filesystem::path& file,
                                          RawlogCompression compression,
                                          const Recording& recording);

}  // namespace efm
