// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/io/CStream.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

struct gzFile_s;  // of zlib

namespace efm {

using GzFile = std::unique_ptr<gzFile_s, int (*)(gzFile_s*)>;

/// A pipe is read in small pieces, so that what was written to it is there soon.
enum class GzSource { kFile, kPipe };

/// A gzip file or a plain file as an MRPT stream for reading. A truncated file is an error, which
/// mrpt::io::CFileGZInputStream does not notice.
class GzInputStream : public mrpt::io::CStream {
 public:
  /// Opening a pipe waits for its writer; reading, for more data.
  /// @throws std::runtime_error naming the file if it cannot be opened.
  explicit GzInputStream(const std::filesystem::path& file, GzSource source = GzSource::kFile);

  /// @throws std::runtime_error if the file is truncated or its compression is damaged.
  bool atEnd();
  /// The fraction of the file that has been read, 0 to 1; of a pipe, 1.
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
  std::size_t buffer_size_;
  std::uint64_t file_size_ = 0;
  std::uint64_t position_ = 0;
  std::vector<std::uint8_t> buffer_;
  std::size_t at_ = 0;  // in the buffer
};

/// A gzip file, with MRPT's compression level, 1, or a plain file, as an MRPT stream for writing.
class GzOutputStream : public mrpt::io::CStream {
 public:
  /// @throws std::runtime_error naming the file if it cannot be created.
  explicit GzOutputStream(const std::filesystem::path& file, bool compressed = true);

  /// Completes the file. @throws std::runtime_error if not all bytes could be written.
  void close();

  std::size_t Read(void* buffer, std::size_t count) override;  ///< Throws: write only.
  /// @throws std::runtime_error if not all bytes could be written.
  std::size_t Write(const void* buffer, std::size_t count) override;
  std::uint64_t Seek(std::int64_t offset, TSeekOrigin origin) override;  ///< Throws: forward only.
  std::uint64_t getTotalBytesCount() const override { return position_; }
  std::uint64_t getPosition() const override { return position_; }

 private:
  GzFile file_;
  std::uint64_t position_ = 0;
};

}  // namespace efm
