// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace efm {

/// A file that appears under its name when it is complete. Until then it has a temporary name in
/// the same folder. A reader sees the complete file, the previous one, or none. A symbolic link
/// stays, and its target is replaced.
class AtomicFile {
 public:
  /// @throws std::runtime_error naming `path` where it is no file name, or a folder or a device has
  /// that name.
  explicit AtomicFile(const std::filesystem::path& path);
  /// Removes the temporary file.
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// The temporary name: "map.partial.pcd" for "map.pcd". A killed program leaves a file there; the
  /// next one that writes the file replaces it.
  static std::filesystem::path temporaryOf(const std::filesystem::path& path);

  /// The file that `replace` creates or replaces.
  const std::filesystem::path& path() const { return path_; }
  /// The file to write.
  const std::filesystem::path& temporary() const { return temporary_; }
  /// Renames the complete temporary file. @throws std::filesystem::filesystem_error.
  void replace() const { std::filesystem::rename(temporary_, path_); }

 private:
  std::filesystem::path path_;
  std::filesystem::path temporary_;
};

/// Writes a file by an AtomicFile.
/// @param write creates the file at the path that it receives.
/// @throws std::runtime_error naming `path` where the file cannot be written or renamed. The
/// message includes that of `write`, or that the disk is full.
void writeAtomically(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write);

/// Why bytes cannot be written, in words: the disk is full, or a limit is reached. Empty for other
/// values of errno.
std::string reasonNotWritten(int error_number);

/// All bytes of a file.
/// @throws std::runtime_error where the file does not exist, is not regular, or cannot be read to
/// its end. The message does not name the file.
std::string readBytes(const std::filesystem::path& path);

}  // namespace efm
