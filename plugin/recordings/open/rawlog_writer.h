// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>

#include <filesystem>
#include <memory>

#include "mapping/base/atomic_file.h"

namespace efm {

class GzOutputStream;

enum class RawlogCompression { kGzip, kZstd, kNone };

/// Writes observations as a rawlog that MRPT's own programs read. The file gets its name when it is
/// complete.
class RawlogWriter {
 public:
  /// @param file an earlier file of this name is replaced: see AtomicFile.
  /// @param compression gzip for the whole file, MRPT's default; or Zstandard for the events alone,
  /// three times as fast, in a plain file.
  /// @throws std::runtime_error naming the file if it cannot be created or replaced.
  explicit RawlogWriter(const std::filesystem::path& file,
                        RawlogCompression compression = RawlogCompression::kGzip);
  /// Without `close`, there is no file.
  ~RawlogWriter();

  /// @throws std::runtime_error naming the file if it cannot be written.
  void write(mrpt::obs::CObservation& observation);
  void close();

 private:
  AtomicFile file_;
  RawlogCompression compression_;
  std::unique_ptr<GzOutputStream> stream_;
};

}  // namespace efm
