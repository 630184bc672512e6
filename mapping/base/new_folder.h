// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

namespace efm {

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
  /// Gives the folder its name. @throws std::runtime_error naming it.
  void finish();

 private:
  std::filesystem::path folder_;
  std::filesystem::path unfinished_;  // empty after it was renamed
};

}  // namespace efm
