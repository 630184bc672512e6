// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <string>

namespace efm {

/// When a file is on the disk: with its name, or when its writer calls `syncToDisk`.
enum class DiskSync { kNow, kLater };

/// A file that appears under its name when it is complete and on the disk. Until then it has a
/// temporary name in the same folder. A reader sees the complete file, the previous one, or none,
/// also after a crash of the system. A symbolic link stays, and its target is replaced.
class AtomicFile {
 public:
  /// Makes the temporary file, under a name that no file has.
  /// @throws std::runtime_error naming `path` where it is no file name, a folder or a device has
  /// that name, or no file can be made there.
  explicit AtomicFile(const std::filesystem::path& path);
  /// Removes the temporary file if `replace` was not called.
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// The temporary names of a process: "map.partial-1234.pcd" for "map.pcd", where another file has
  /// that name "map.partial-1234-1.pcd", and so on. A killed process leaves its file.
  static std::filesystem::path temporaryName(const std::filesystem::path& path, pid_t process,
                                             int trial);

  /// The file that `replace` creates or replaces.
  const std::filesystem::path& path() const { return path_; }
  /// The file to write: empty, with the extension of `path`.
  const std::filesystem::path& temporary() const { return temporary_; }
  /// @param write fills the file at the path that it receives.
  /// @throws std::runtime_error naming `path`, with the message of `write`, or that the disk is
  /// full.
  void fill(const std::function<void(const std::filesystem::path& temporary)>& write) const;
  /// Gives the complete temporary file its name. With `kNow` it is on the disk before.
  /// @throws std::filesystem::filesystem_error.
  void replace(DiskSync sync = DiskSync::kNow);

 private:
  std::filesystem::path path_;
  std::filesystem::path temporary_;  // empty after it was renamed
};

/// Writes a file by an AtomicFile.
/// @param write fills the file at the path that it receives.
/// @throws std::runtime_error naming `path` where the file cannot be written or renamed. The
/// message includes that of `write`, or that the disk is full.
void writeAtomically(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write,
                     DiskSync sync = DiskSync::kNow);

/// Waits until a file, or the names of the files in a folder, are on the disk. A file system that
/// cannot do that is left as it is.
/// @throws std::filesystem::filesystem_error naming the path where the disk does not take it.
void syncToDisk(const std::filesystem::path& path);

/// Why bytes cannot be written, in words: the disk is full, or a limit is reached. Empty for other
/// values of errno.
std::string reasonNotWritten(int error_number);

/// All bytes of a file.
/// @throws std::runtime_error where the file does not exist, is not regular, or cannot be read to
/// its end. The message does not name the file.
std::string readBytes(const std::filesystem::path& path);

/// A folder that appears under its name when all its files are written and on the disk. Until then
/// it has a temporary name in the same parent folder; it is removed after an error.
class NewFolder {
 public:
  /// Makes the temporary folder: ".NAME.unfinished-PROCESS", or where that exists, with a number.
  /// @throws std::runtime_error naming the path where the folder exists and is not empty, or cannot
  /// be made.
  explicit NewFolder(std::filesystem::path folder);
  ~NewFolder();
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

  /// The folder to write into.
  const std::filesystem::path& temporary() const { return unfinished_; }
  /// Gives the folder its name.
  void finish();

 private:
  std::filesystem::path folder_;
  std::filesystem::path unfinished_;  // empty after it was renamed
};

}  // namespace efm
