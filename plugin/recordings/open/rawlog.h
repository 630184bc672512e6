// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/io/CStream.h>
#include <mrpt/obs/CObservation.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mapping/base/atomic_file.h"
#include "plugin/mrpt/pose_observation.h"
#include "plugin/recordings/open/merged_recording.h"

struct gzFile_s;  // of zlib

namespace efm {

using GzFile = std::unique_ptr<gzFile_s, int (*)(gzFile_s*)>;

/// A gzip file or a plain file as an MRPT stream for reading. A truncated file is an error, which
/// mrpt::io::CFileGZInputStream does not notice.
class GzInputStream : public mrpt::io::CStream {
 public:
  explicit GzInputStream(const std::filesystem::path& file);

  /// @throws std::runtime_error if the file is truncated or its compression is damaged.
  bool atEnd();
  /// The fraction of the file that has been read, 0 to 1.
  double progress() const;

  /// @return less than `count` only at the end.
  /// @throws std::runtime_error as `atEnd`.
  std::size_t Read(void* buffer, std::size_t count) override;
  std::size_t Write(const void* buffer, std::size_t count) override;     ///< Throws: read only.
  std::uint64_t Seek(std::int64_t offset, TSeekOrigin origin) override;  ///< Throws: forward only.
  std::uint64_t getTotalBytesCount() const override;                     ///< Throws: not known.
  std::uint64_t getPosition() const override { return position_; }

 private:
  void fill();

  GzFile file_;
  std::uint64_t file_size_ = 0;
  std::uint64_t position_ = 0;
  std::vector<std::uint8_t> buffer_;
  std::size_t at_ = 0;  // in the buffer
};

/// A gzip file, with MRPT's compression level, 1, or a plain file, as an MRPT stream for writing.
class GzOutputStream : public mrpt::io::CStream {
 public:
  explicit GzOutputStream(const std::filesystem::path& file, bool compressed = true);

  /// Completes the file.
  void close();

  std::size_t Read(void* buffer, std::size_t count) override;  ///< Throws: write only.
  std::size_t Write(const void* buffer, std::size_t count) override;
  std::uint64_t Seek(std::int64_t offset, TSeekOrigin origin) override;  ///< Throws: forward only.
  std::uint64_t getTotalBytesCount() const override { return position_; }
  std::uint64_t getPosition() const override { return position_; }

 private:
  GzFile file_;
  std::uint64_t position_ = 0;
};

/// Why the first bytes are not those of a rawlog: "it begins with …"; nothing where they are, and
/// of a damaged gzip file.
std::optional<std::string> whyNoRawlog(const std::filesystem::path& file);

/// Checks the first bytes of a rawlog, compressed or not: the name of an object's class, as MRPT
/// writes it. Does not check for later damage.
void requireRawlog(const std::filesystem::path& file);

/// A rawlog, gzip-compressed or plain, read entry by entry. Its observations, also those in sensory
/// frames, come one by one. The movements of actions are composed to poses (see DeadReckoning),
/// which come before the next frame; of several poses with the same time only the last. Other
/// actions and comments are ignored.
class RawlogRecording : public Recording {
 public:
  explicit RawlogRecording(std::filesystem::path file);

  /// @throws std::runtime_error "stopped at entry N of FILE: reason" if the file is truncated or
  /// damaged, or has an unknown class. Entries count from 0, as in MRPT's programs. All entries
  /// before N have been returned.
  mrpt::obs::CObservation::Ptr next() override;
  std::string position() const override;
  double progress() const override { return stream_.progress(); }

 private:
  void readEntry();
  void takeActions(const mrpt::obs::CSensoryFrame& frame);
  std::string whyStopped(const std::exception& error);

  std::filesystem::path file_;
  GzInputStream stream_;
  std::uint64_t entries_ = 0;  // read so far
  std::deque<mrpt::obs::CObservation::Ptr> pending_;
  std::deque<mrpt::obs::CActionCollection::Ptr> actions_;  // before the next frame
  DeadReckoning reckoning_;
};

enum class RawlogCompression { kGzip, kZstd, kNone };

/// Writes observations as a rawlog that MRPT's own programs read. The file gets its name when it is
/// complete.
class RawlogWriter {
 public:
  /// @param file an earlier file of this name is replaced: see AtomicFile.
  /// @param compression gzip for the whole file, MRPT's default; or Zstandard for the events alone,
  /// three times as fast, in a plain file.
  explicit RawlogWriter(const std::filesystem::path& file,
                        RawlogCompression compression = RawlogCompression::kGzip);
  /// Without `close`, there is no file.
  ~RawlogWriter();

  void write(mrpt::obs::CObservation& observation);
  void close();

 private:
  AtomicFile file_;
  RawlogCompression compression_;
  std::unique_ptr<GzOutputStream> stream_;
};

}  // namespace efm
