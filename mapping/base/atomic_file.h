// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <ostream>
#include <string>

namespace efm {

/// Fills a file by a function, which receives its path.
/// @param named in errors, if another file is meant.
/// @throws std::runtime_error with the message of `write`, or that the disk is full.
void fillFile(const std::filesystem::path& path, const std::filesystem::path& named,
              const std::function<void(const std::filesystem::path& path)>& write);

/// Returns a function for `fillFile` and `writeAtomically`; `write` puts the content into a stream.
std::function<void(const std::filesystem::path& path)> byStream(
    std::function<void(std::ostream&)> write);

/// A file that appears under its name when it is complete and on the disk. Until then it has a
/// temporary name in the same folder. A reader sees the complete file, the previous file or none,
/// also after a crash of the system. A symbolic link stays, and its target is replaced.
class AtomicFile {
 public:
  /// Creates the temporary file, under a name that no other file has.
  /// @throws std::runtime_error naming `path` if it is not a file name, if it names a folder or a
  /// device, or if no file can be created there.
  explicit AtomicFile(const std::filesystem::path& path);
  /// Removes the temporary file unless `replace` was called.
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Returns the path of the file that `replace` creates or replaces.
  const std::filesystem::path& path() const { return path_; }
  /// Returns the path of the file to write: empty at first, with the extension of `path`.
  const std::filesystem::path& temporary() const { return temporary_; }
  /// Flushes the complete temporary file to the disk, and renames it to `path`.
  /// @throws std::filesystem::filesystem_error.
  void replace();

 private:
  std::filesystem::path path_;
  std::filesystem::path temporary_;  // empty after the file was renamed
};

/// Writes a file by an AtomicFile.
/// @param write fills the file at the path that it receives.
/// @throws std::runtime_error naming `path` if the file cannot be written or renamed. It has the
/// message of `write`, or says that the disk is full.
void writeAtomically(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write);

/// Waits until a file, or the names of the files in a folder, are on the disk. Does nothing if the
/// file system cannot flush, or if the path cannot be opened for reading.
/// @throws std::filesystem::filesystem_error naming the path if the disk reports an error.
void syncToDisk(const std::filesystem::path& path);

/// Returns the reason why bytes cannot be written, as text: the disk is full, or a limit is
/// reached. Returns an empty string for other values of errno.
std::string reasonNotWritten(int error_number);

/// Returns all bytes of a file.
/// @throws std::runtime_error if the file does not exist, is not regular, or cannot be read to its
/// end. The message does not name the file.
std::string readBytes(const std::filesystem::path& path);

/// A folder that appears under its name when all its files are written and on the disk. Until then
/// it has a temporary name in the same parent folder. After an error the folder is removed.
class NewFolder {
 public:
  /// Creates the temporary folder: ".NAME.unfinished-PROCESS", plus a number if that folder exists.
  /// @throws std::runtime_error naming the path if the folder exists and is not empty, or cannot be
  /// created.
  explicit NewFolder(std::filesystem::path folder);
  ~NewFolder();
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

  /// Returns the folder to write into.
  const std::filesystem::path& temporary() const { return unfinished_; }
  /// Renames the temporary folder to its final name.
  void finish();

 private:
  std::filesystem::path folder_;
  std::filesystem::path unfinished_;  // empty after the folder was renamed
};

}  // namespace efm
