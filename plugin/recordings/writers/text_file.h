// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <fstream>
#include <memory>
#include <utility>

#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"

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

/// poses.txt, TUM format. Without a pose there is no file.
class PoseTextFile {
 public:
  explicit PoseTextFile(std::filesystem::path path) : path_(std::move(path)) {}

  /// @throws std::runtime_error naming the file if it cannot be made.
  void add(const StampedPose& pose);
  /// @throws std::runtime_error naming the file if it could not be written.
  void close();

 private:
  std::filesystem::path path_;
  std::unique_ptr<TextFile> file_;
};

/// Writes camchain.yaml, if the cameras are calibrated.
/// @throws std::runtime_error naming the file if it cannot be written.
void writeCamchain(const std::filesystem::path& folder, const Rig& rig);

}  // namespace efm
