// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>

#include <filesystem>
#include <memory>

namespace efm {

class GzOutputStream;

/// Writes observations as a rawlog that MRPT's own programs read. The file appears under its name
/// only once it is complete.
class RawlogWriter {
 public:
  /// @param file what is there is replaced in the end, where `replaceableFile` allows it.
  /// @throws std::runtime_error naming the file where it cannot be made or replaced.
  explicit RawlogWriter(const std::filesystem::path& file);
  /// Without `close` nothing is left behind.
  ~RawlogWriter();
  RawlogWriter(const RawlogWriter&) = delete;
  RawlogWriter& operator=(const RawlogWriter&) = delete;

  /// @throws std::runtime_error naming the file where it cannot be written.
  void write(const mrpt::obs::CObservation& observation);
  void close();

 private:
  std::filesystem::path file_;
  std::filesystem::path temporary_;
  std::unique_ptr<GzOutputStream> stream_;
};

}  // namespace efm
