// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

struct archive;

namespace efm {

/// Returns whether the first bytes are those of a compressed file (gzip, bzip2, xz, Zstandard) or a
/// zip archive. Never throws.
bool isCompressed(const std::filesystem::path& file);

/// Reads the bytes of a file from front to back. Compressed files and members of zip archives are
/// unpacked. Memory holds one block.
class FileContent {
 public:
  /// @param member name of a file in a zip archive; empty: the only file in it.
  /// @throws std::runtime_error if the file cannot be opened, has no such member, has several files
  /// for an empty `member`, or if this build does not read archives (EFM_READ_ARCHIVES).
  explicit FileContent(std::filesystem::path file, const std::string& member = {});

  /// @return the number of bytes read: fewer than `count` only at the end.
  std::size_t read(char* to, std::size_t count);
  /// Reads the rest of the file.
  /// @throws std::runtime_error as `read`, and if the rest is longer than `max_bytes`.
  std::string readAll(std::size_t max_bytes);

  /// The size of a plain file; 0 for compressed files and pipes, which cannot seek.
  std::uint64_t seekableBytes() const { return archive_ ? 0 : bytes_; }
  /// Continues at a byte of a plain file.
  void seek(std::uint64_t byte);
  /// The fraction of the file's bytes that has been read, 0 to 1.
  double progress() const;
  const std::filesystem::path& file() const { return file_; }

 private:
  struct CloseArchive {
    void operator()(archive* opened) const;
  };
  std::runtime_error failure(const std::string& what) const;

  std::filesystem::path file_;
  std::string member_;
  std::uint64_t bytes_ = 0;
  std::uint64_t position_ = 0;  // of a plain file
  std::ifstream plain_;
  std::unique_ptr<archive, CloseArchive> archive_;
};

/// Returns the first `count` bytes of a file's content, or all bytes if there are fewer.
/// @throws std::runtime_error as `FileContent`.
std::string firstContentOf(const std::filesystem::path& file, std::size_t count,
                           const std::string& member = {});

/// Returns the names of the files in a zip archive, in the order of the archive.
/// @throws std::runtime_error as `FileContent`.
std::vector<std::string> membersOf(const std::filesystem::path& file);

}  // namespace efm
