// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <fstream>

namespace efm {

/// A text file to write.
class TextFile {
 public:
  /// @throws std::runtime_error naming the file if it cannot be made.
  explicit TextFile(std::filesystem::path path);

  std::ofstream& stream() { return stream_; }
  /// @throws std::runtime_error naming the file if it could not be written, and why if the last
  /// bytes could not.
  void requireWritten() const;
  /// @throws std::runtime_error as `requireWritten`.
  void close();

 private:
  std::filesystem::path path_;
  std::ofstream stream_;
};

}  // namespace efm
