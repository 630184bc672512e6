// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace efm {

/// A file under a temporary name until it is complete: whoever looks sees the whole file, the
/// earlier one, or none. A symbolic link stays, and the file at its end is replaced.
class AtomicFile {
 public:
  /// @throws std::runtime_error naming `path` where it names no file, or is a folder or a device:
  /// replacing that would destroy it.
  explicit AtomicFile(const std::filesystem::path& path);
  /// Removes the temporary file, if it is there.
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// The file to replace; it need not exist.
  const std::filesystem::path& path() const { return path_; }
  /// The file to write, adjacent to it and with the same extension: "map.partial.pcd" for
  /// "map.pcd".
  const std::filesystem::path& temporary() const { return temporary_; }
  /// Renames the complete temporary file. @throws std::filesystem::filesystem_error.
  void replace() const { std::filesystem::rename(temporary_, path_); }

 private:
  std::filesystem::path path_;
  std::filesystem::path temporary_;
};

/// Writes an AtomicFile.
/// @param write creates the file at the path it is given.
/// @throws std::runtime_error naming `path` where it cannot be replaced, written or renamed; the
/// message of an exception of `write` becomes part of it.
void writeAtomically(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write);

/// All bytes of a file.
/// @throws std::runtime_error saying why it cannot be read (there is none, it is no regular file,
/// it ends before its end), without its name.
std::string readBytes(const std::filesystem::path& path);

}  // namespace efm
