// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>

#include "mapping/base/atomic_file.h"
#include "mapping/geometry/reference_view.h"
#include "mapping/sweep/space_sweep.h"

namespace efm {

/// Writes the whole DSI to a NumPy file (.npy, format 1.0): float32, [plane][row][column]. Each
/// plane goes to disk at once: memory is that of one plane.
class NpyDsiFile : public DsiSink {
 public:
  /// @throws std::runtime_error naming the path where it cannot be created.
  NpyDsiFile(const std::filesystem::path& path, int planes, const ReferenceView& view);

  /// Thread-safe. Errors of the disk are kept for `finish`.
  void addPlane(int plane, const float* values) override;
  /// @return the complete file. Only its `replace` gives it its name; without that no file stays.
  /// @throws std::runtime_error naming the path where it could not be written.
  std::unique_ptr<AtomicFile> finish();

 private:
  std::unique_ptr<AtomicFile> target_;
  std::streamoff plane_bytes_;
  std::streamoff header_bytes_ = 0;
  std::mutex mutex_;  // of file_
  std::ofstream file_;
};

}  // namespace efm
