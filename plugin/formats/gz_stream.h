// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/io/CStream.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace efm {

/// A gzip file, or a plain one, as an MRPT stream to read from. It detects a file that was cut;
/// mrpt::io::CFileGZInputStream does not.
class GzInputStream : public mrpt::io::CStream {
 public:
  /// @throws std::runtime_error naming the file where it cannot be opened.
  explicit GzInputStream(const std::filesystem::path& file);
  ~GzInputStream() override;
  GzInputStream(const GzInputStream&) = delete;
  GzInputStream& operator=(const GzInputStream&) = delete;

  /// Whether the whole file has been read.
  /// @throws std::runtime_error if the file is cut or its compression is damaged.
  bool atEnd();
  /// The fraction of the file that was read, 0 to 1.
  double progress() const;

  /// @return the number of bytes read; fewer than requested only at the end.
  /// @throws std::runtime_error as `atEnd`.
  std::size_t Read(void* buffer, std::size_t count) override;
  std::size_t Write(const void* buffer, std::size_t count) override;     ///< Throws: read only.
  std::uint64_t Seek(std::int64_t offset, TSeekOrigin origin) override;  ///< Throws: forward only.
  std::uint64_t getTotalBytesCount() const override;                     ///< Throws: not known.
  std::uint64_t getPosition() const override { return position_; }

 private:
  void fill();

  struct File;
  std::unique_ptr<File> file_;
  std::uint64_t file_size_ = 0;
  std::uint64_t position_ = 0;
  std::vector<std::uint8_t> buffer_;
  std::size_t at_ = 0;  // in the buffer
};

/// A gzip file as an MRPT stream to write to, at MRPT's own compression level, 1.
class GzOutputStream : public mrpt::io::CStream {
 public:
  /// @throws std::runtime_error naming the file if it cannot be created.
  explicit GzOutputStream(const std::filesystem::path& file);
  ~GzOutputStream() override;
  GzOutputStream(const GzOutputStream&) = delete;
  GzOutputStream& operator=(const GzOutputStream&) = delete;

  /// Completes the file. @throws std::runtime_error if a part could not be written.
  void close();

  std::size_t Read(void* buffer, std::size_t count) override;  ///< Throws: write only.
  /// @throws std::runtime_error if a part could not be written.
  std::size_t Write(const void* buffer, std::size_t count) override;
  std::uint64_t Seek(std::int64_t offset, TSeekOrigin origin) override;  ///< Throws: forward only.
  std::uint64_t getTotalBytesCount() const override { return position_; }
  std::uint64_t getPosition() const override { return position_; }

 private:
  struct File;
  std::unique_ptr<File> file_;
  std::uint64_t position_ = 0;
};

}  // namespace efm
