// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mrpt/obs/CObservation.h>

#include <filesystem>
#include <memory>

#include "maps/io/atomic_file.h"

namespace efm {

class GzOutputStream;

/// Writes observations as a rawlog that MRPT's own programs read. The file gets its name when it is
/// complete.
class RawlogWriter {
 public:
  /// @param file an earlier file of this name is replaced: see AtomicFile.
  /// @throws std::runtime_error naming the file if it cannot be created or replaced.
  explicit RawlogWriter(const std::filesystem::path& file);
  /// Without `close`, there is no file.
  ~RawlogWriter();

  /// @throws std::runtime_error naming the file if it cannot be written.
  void write(const mrpt::obs::CObservation& observation);
  void close();

 private:
  AtomicFile file_;
  std::unique_ptr<GzOutputStream> stream_;
};

}  // namespace efm
