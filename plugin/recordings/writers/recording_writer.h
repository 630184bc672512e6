// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "mapping/events/event.h"
#include "mapping/geometry/rig.h"
#include "mapping/geometry/trajectory.h"

namespace efm {

/// Writes a recording in a format of other tools, in constant memory. Results get their names when
/// `close` is called; without it, nothing is left.
class RecordingWriter {
 public:
  virtual ~RecordingWriter() = default;

  /// @param camera index in the rig.
  /// @param events in time order, not before the camera's earlier ones. Times in ns of the
  /// recording's clock, with the camera's time offset already added.
  /// @throws std::runtime_error naming the file if it cannot be written, or the format cannot hold
  /// a value.
  virtual void addEvents(std::size_t camera, const std::vector<Event>& events) = 0;
  /// @param pose T_world_rig; poses come in time order.
  virtual void addPose(const StampedPose& pose) = 0;
  /// Adds a depth map of camera 0: a float32 TIFF file in metres. Most formats have no place for
  /// it.
  virtual void addTruth(std::int64_t t_ns, const std::filesystem::path& file) {
    static_cast<void>(t_ns);
    static_cast<void>(file);
  }
  /// Completes the files.
  virtual void close() = 0;
};

}  // namespace efm
